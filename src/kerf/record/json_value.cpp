#include "kerf/record/json_value.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace kerf {
namespace {

/// What nlohmann's reader tells of a text, one part after the other.
class Builder {
 public:
  using number_integer_t = std::int64_t;
  using number_unsigned_t = std::uint64_t;
  using number_float_t = double;
  using string_t = std::string;
  using binary_t = nlohmann::json::binary_t;

  explicit Builder(std::size_t deepest) : deepest_(deepest) {}
  JsonValue root;

  bool null() { return put({}); }
  bool boolean(bool b) { return put(JsonValue(b)); }
  bool number_integer(std::int64_t i) { return put(JsonValue(i)); }
  bool number_unsigned(std::uint64_t u) { return put(JsonValue(u)); }
  bool number_float(double d, const std::string& /*as written*/) { return put(JsonValue(d)); }
  bool string(std::string& s) { return put(JsonValue(std::move(s))); }
  bool binary(binary_t& /*bytes*/) { return false; }
  bool start_object(std::size_t /*size*/) { return open(JsonValue(JsonValue::Object())); }
  bool start_array(std::size_t /*size*/) { return open(JsonValue(JsonValue::Array())); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }
  bool key(std::string& s) {
    key_ = std::move(s);
    return true;
  }
  bool parse_error(std::size_t /*at*/, const std::string& /*token*/, const nlohmann::json::exception& /*why*/) {
    return false;
  }

 private:
  JsonValue& place(JsonValue value) {
    if (path_.empty()) return root = std::move(value);
    return path_.back()->add(std::move(value), std::move(key_));
  }
  bool put(JsonValue value) {
    place(std::move(value));
    return true;
  }
  bool open(JsonValue value) {
    if (path_.size() == deepest_) return false;
    path_.push_back(&place(std::move(value)));
    return true;
  }
  bool close() {
    path_.pop_back();
    return true;
  }

  std::vector<JsonValue*> path_;  ///< what is open: each lies last in the one before it, so that none moves
  std::string key_;
  std::size_t deepest_;
};

}  // namespace

std::optional<double> JsonValue::number() const {
  if (const auto* d = std::get_if<double>(&value_)) return *d;
  if (const auto* i = std::get_if<std::int64_t>(&value_)) return static_cast<double>(*i);
  if (const auto* u = std::get_if<std::uint64_t>(&value_)) return static_cast<double>(*u);
  return std::nullopt;
}

std::optional<std::uint64_t> JsonValue::whole() const {
  if (const auto* i = std::get_if<std::int64_t>(&value_); i != nullptr && *i >= 0)
    return static_cast<std::uint64_t>(*i);
  if (const auto* u = std::get_if<std::uint64_t>(&value_)) return *u;
  return std::nullopt;
}

const JsonValue* JsonValue::find(std::string_view key) const {
  const Object* members = object();
  if (members == nullptr) return nullptr;
  const auto found = std::find_if(members->rbegin(), members->rend(), [&](const auto& m) { return m.first == key; });
  return found == members->rend() ? nullptr : &found->second;
}

JsonValue& JsonValue::add(JsonValue value, std::string key) {
  if (auto* items = std::get_if<Array>(&value_)) return items->emplace_back(std::move(value));
  return std::get<Object>(value_).emplace_back(std::move(key), std::move(value)).second;
}

std::optional<JsonValue> parse_json(std::string_view text, std::size_t deepest) {
  Builder builder(deepest);
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &builder)) return std::nullopt;
  return std::move(builder.root);
}

}  // namespace kerf
