#include <cairo/cairo-pdf.h>
#include <cairo/cairo.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "server/annotate/paint/document.hpp"
#include "server/annotate/paint/paint.hpp"

namespace windsplat::annotate {
namespace {

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Target = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

cairo_status_t append(void* bytes, const unsigned char* data, unsigned length) {
  static_cast<image::Bytes*>(bytes)->insert(static_cast<image::Bytes*>(bytes)->end(), data,
                                            data + length);
  return CAIRO_STATUS_SUCCESS;
}

// Cairo's RGB24: a word for each pixel, red in bits 16 to 23.
std::vector<std::uint32_t> words_of(std::span<const std::uint8_t> rgb) {
  std::vector<std::uint32_t> words(rgb.size() / 3);
  for (std::size_t n = 0; n < words.size(); ++n) {
    words[n] = std::uint32_t{rgb[3 * n]} << 16U | std::uint32_t{rgb[3 * n + 1]} << 8U |
               std::uint32_t{rgb[3 * n + 2]};
  }
  return words;
}

}  // namespace

Result<image::Bytes> encode_pdf(const Page& page) {
  constexpr double points_per_inch = 72;
  const double scale = points_per_inch / page.dots_per_inch;
  image::Bytes bytes;
  const Surface document(
      cairo_pdf_surface_create_for_stream(append, &bytes, scale * page.width, scale * page.height),
      &cairo_surface_destroy);
  cairo_pdf_surface_restrict_to_version(document.get(), CAIRO_PDF_VERSION_1_5);
  // A fixed date, so that equal pictures are equal files.
  cairo_pdf_surface_set_metadata(document.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                 "1970-01-01T00:00:00Z");
  std::vector<std::uint32_t> words = words_of(page.rgb);
  const Surface picture(cairo_image_surface_create_for_data(
                            reinterpret_cast<unsigned char*>(words.data()), CAIRO_FORMAT_RGB24,
                            page.width, page.height, 4 * page.width),
                        &cairo_surface_destroy);
  const Target target(cairo_create(document.get()), &cairo_destroy);
  cairo_scale(target.get(), scale, scale);
  cairo_set_source_surface(target.get(), picture.get(), 0, 0);
  cairo_paint(target.get());
  for (const Part& part : page.parts) {
    cairo_save(target.get());
    if (part.figure.width < page.width) {
      cairo_translate(target.get(), part.left, 0);
      cairo_rectangle(target.get(), 0, 0, part.figure.width, part.figure.height);
      cairo_clip(target.get());
    }
    paint(part.figure.above, target.get());
    cairo_restore(target.get());
  }
  cairo_show_page(target.get());
  cairo_surface_finish(document.get());
  for (const cairo_status_t status :
       {cairo_status(target.get()), cairo_surface_status(document.get())}) {
    if (status == CAIRO_STATUS_SUCCESS) continue;
    return make_error(
        status == CAIRO_STATUS_NO_MEMORY ? ErrorKind::out_of_memory : ErrorKind::internal,
        std::string("the PDF cannot be written: ") + cairo_status_to_string(status));
  }
  return bytes;
}

Result<image::Bytes> encode_pdf(std::span<const std::uint8_t> rgb, const Figure& figure,
                                double dots_per_inch) {
  const Part whole{figure};
  return encode_pdf({rgb, figure.width, figure.height, {&whole, 1}, dots_per_inch});
}

}  // namespace windsplat::annotate
