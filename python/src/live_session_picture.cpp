// Pictures of a session.
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "arrays.h"
#include "errors.h"
#include "interrupts.h"
#include "live_session.h"
#include "live_session_use.h"
#include "python_lock.h"

namespace nb = nanobind;

namespace kerf::python {
namespace {

/// Red, green, blue and alpha of each pixel; all 0 where nothing is.
std::vector<std::uint8_t> with_alpha(const std::vector<std::uint8_t>& rgb, const std::vector<float>& far) {
  std::vector<std::uint8_t> out(4 * far.size(), 0);
  for (std::size_t i = 0; i < far.size(); ++i) {
    if (!std::isfinite(far[i])) continue;
    for (std::size_t c = 0; c < 3; ++c) out[4 * i + c] = rgb[3 * i + c];
    out[4 * i + 3] = 255;
  }
  return out;
}

}  // namespace

Status LiveSession::make_painter() {
  if (painter_) return {};
  auto painter = SessionPainter::create(*session_);
  if (!painter) return painter.error();
  painter_ = std::move(*painter);
  return {};
}

PictureView LiveSession::fitted_view(int width, int height) {
  Use session(*this);
  PictureView view;
  check(unlocked([&]() -> Status {
    KERF_TRY(make_painter());
    view = painter_->fitted_view(*session, session->scene().output.camera, width, height);
    return {};
  }));
  return view;
}

nb::object LiveSession::render(int width, int height, std::optional<PictureView> view, PictureWish wish) {
  Use session(*this);
  const auto rows = static_cast<std::size_t>(height), columns = static_cast<std::size_t>(width);
  std::vector<std::uint8_t> colors;
  std::vector<float> far;
  Interrupts interrupts;
  const Status drawn = unlocked([&]() -> Status {
    KERF_TRY(make_painter());
    SceneOutput output;
    output.camera = session->scene().output.camera;
    output.picture_size = {width, height};
    if (!view) view = painter_->fitted_view(*session, output.camera, width, height);
    if (wish.shadows) colors = painter_->draw(*session, output, view, [&] { return interrupts.wanted(); }).rgb;
    else colors.resize(3 * rows * columns);
    if (interrupts.wanted()) return {};
    if (wish.depth || wish.alpha) far.resize(rows * columns);
    if (!far.empty() || !wish.shadows)
      painter_->draw_quickly(*session, *view,
                             {width, height, wish.shadows ? std::span<std::uint8_t>() : std::span(colors), far});
    if (wish.alpha) colors = with_alpha(colors, far);
    return {};
  });
  interrupts.raise();
  check(drawn);
  const nb::object picture =
      own_array<std::uint8_t>(std::move(colors), {rows, columns, std::size_t{wish.alpha ? 4u : 3u}});
  if (!wish.depth) return picture;
  return nb::make_tuple(picture, own_array<float>(std::move(far), {rows, columns}));
}

}  // namespace kerf::python
