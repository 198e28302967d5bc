// JSON as it was read. Taking it apart asks for no memory: nlohmann's values do, and where memory ends on the way the program would.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace kerf {

class JsonValue {
 public:
  using Array = std::vector<JsonValue>;
  using Object = std::vector<std::pair<std::string, JsonValue>>;  ///< in the order of the text
  using Any = std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double, std::string, Array, Object>;

  JsonValue() = default;
  explicit JsonValue(Any value) : value_(std::move(value)) {}

  [[nodiscard]] bool is_null() const { return std::holds_alternative<std::nullptr_t>(value_); }
  [[nodiscard]] bool is_true() const { return value_ == Any(true); }
  [[nodiscard]] const std::string* text() const { return std::get_if<std::string>(&value_); }
  [[nodiscard]] const Array* array() const { return std::get_if<Array>(&value_); }
  [[nodiscard]] const Object* object() const { return std::get_if<Object>(&value_); }
  /// Of a number, whole or not.
  [[nodiscard]] std::optional<double> number() const;
  /// Of a whole number from 0 on.
  [[nodiscard]] std::optional<std::uint64_t> whole() const;
  /// Of an object: the value of a key, of several the last. Null: it has none, or is no object. Cost: that of looking at all keys.
  [[nodiscard]] const JsonValue* find(std::string_view key) const;
  /// What is put into an array or an object stays where it is until the next is.
  JsonValue& add(JsonValue value, std::string key);

  friend bool operator==(const JsonValue& a, const JsonValue& b) { return a.value_ == b.value_; }

 private:
  Any value_ = nullptr;
};

/// None: it is no JSON, is cut off, or is nested deeper than `deepest`.
std::optional<JsonValue> parse_json(std::string_view text, std::size_t deepest);

}  // namespace kerf
