#include "gunzip.h"

#include <array>
#include <utility>  // before Beast 1.74

#include <boost/beast/zlib/inflate_stream.hpp>

namespace kerf::app {
namespace {

constexpr std::size_t kHeader = 10, kTrailer = 8;
enum Flags : unsigned char { kHeaderCheck = 2, kExtra = 4, kName = 8, kComment = 16 };

}  // namespace

std::optional<std::string> gunzip(std::string_view packed) {
  namespace zlib = boost::beast::zlib;
  if (packed.size() < kHeader + kTrailer || !packed.starts_with("\x1f\x8b\x08")) return {};
  const auto flags = static_cast<unsigned char>(packed[3]);
  std::size_t at = kHeader;
  if (flags & kExtra) {
    const auto low = static_cast<unsigned char>(packed[at]), high = static_cast<unsigned char>(packed[at + 1]);
    at += 2 + low + 256u * high;
  }
  for (const unsigned char text : {kName, kComment})
    if (flags & text) at = packed.find('\0', at) == std::string_view::npos ? packed.size() : packed.find('\0', at) + 1;
  if (flags & kHeaderCheck) at += 2;
  if (at + kTrailer > packed.size()) return {};

  zlib::inflate_stream stream;
  stream.reset(15);
  zlib::z_params params;
  params.next_in = packed.data() + at;
  params.avail_in = packed.size() - at - kTrailer;
  std::string out;
  std::array<char, 1 << 16> piece{};
  for (;;) {
    params.next_out = piece.data();
    params.avail_out = piece.size();
    boost::system::error_code error;
    stream.write(params, zlib::Flush::sync, error);
    out.append(piece.data(), piece.size() - params.avail_out);
    if (error == zlib::error::end_of_stream) return out;
    if (error || params.avail_out == piece.size()) return {};
  }
}

}  // namespace kerf::app
