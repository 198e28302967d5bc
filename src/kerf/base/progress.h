// Long work reports how far it is; the caller decides what to show, and may ask it to stop. The library never prints.
#pragma once

#include <functional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "kerf/base/result.h"

namespace kerf {

/// Hears of progress. stage: what is being done ("paths", "parameters"); fraction: 0 to 1 of that stage. A listener that
/// returns false asks the work to stop: it then ends with an error.
class Progress {
 public:
  Progress() = default;
  template <class Listener>
  requires std::is_invocable_v<Listener&, std::string_view, double> Progress(Listener listener)
      : listener_([listener = std::move(listener)](std::string_view stage, double fraction) mutable {
          if constexpr (std::is_void_v<std::invoke_result_t<Listener&, std::string_view, double>>) {
            listener(stage, fraction);
            return true;
          } else {
            return static_cast<bool>(listener(stage, fraction));
          }
        }) {}

  /// Is anybody listening?
  explicit operator bool() const { return static_cast<bool>(listener_); }
  Status operator()(std::string_view stage, double fraction) const {
    if (!listener_ || listener_(stage, fraction)) return {};
    return failed("stopped as asked");
  }

 private:
  std::function<bool(std::string_view, double)> listener_;
};

}  // namespace kerf
