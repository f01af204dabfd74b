#include "sim/core/png_file.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <spng.h>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

// Pictures have large areas of one colour and depths have noise: more effort of zlib gains little on both.
constexpr int kEffort = 3;

void require(int status) {
  if (status != 0) {
    throw IoError(fmt::format("a PNG image cannot be packed: {}", spng_strerror(status)));
  }
}

}  // namespace

std::string png_file(int width, int height, PngPixels form, std::span<const std::byte> pixels,
                     const std::map<std::string, std::string>& texts) {
  const std::unique_ptr<spng_ctx, decltype(&spng_ctx_free)> png(spng_ctx_new(SPNG_CTX_ENCODER), spng_ctx_free);
  const bool grey = form == PngPixels::kGrey16;
  spng_ihdr header{};
  header.width = static_cast<std::uint32_t>(width);
  header.height = static_cast<std::uint32_t>(height);
  header.bit_depth = grey ? 16 : 8;
  header.color_type = grey ? SPNG_COLOR_TYPE_GRAYSCALE : SPNG_COLOR_TYPE_TRUECOLOR;
  require(spng_set_ihdr(png.get(), &header));
  require(spng_set_option(png.get(), SPNG_ENCODE_TO_BUFFER, 1));
  require(spng_set_option(png.get(), SPNG_IMG_COMPRESSION_LEVEL, kEffort));
  require(spng_set_option(png.get(), SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_UP));
  std::string none;
  std::map<std::string, std::string> kept = texts;  // libspng takes pointers to what it does not change
  std::vector<spng_text> chunks;
  for (auto& [keyword, text] : kept) {
    if (!text.empty()) {
      spng_text& chunk = chunks.emplace_back();
      chunk.type = std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; })
                       ? SPNG_TEXT
                       : SPNG_ITXT;  // few programs show the latter
      keyword.copy(chunk.keyword, sizeof chunk.keyword - 1);
      chunk.text = text.data();
      chunk.length = text.size();
      chunk.language_tag = chunk.translated_keyword = none.data();
    }
  }
  if (!chunks.empty()) {
    require(spng_set_text(png.get(), chunks.data(), static_cast<std::uint32_t>(chunks.size())));
  }
  require(spng_encode_image(png.get(), pixels.data(), pixels.size(), SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE));
  int status = 0;
  std::size_t size = 0;
  const std::unique_ptr<void, decltype(&std::free)> bytes(spng_get_png_buffer(png.get(), &size, &status), std::free);
  require(status);
  return {static_cast<const char*>(bytes.get()), size};
}

}  // namespace touchfield
