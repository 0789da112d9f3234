#include "server/annotate/paint/type.hpp"

#include <cairo/cairo-ft.h>
#include <cairo/cairo.h>
#include <harfbuzz/hb.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "server/annotate/paint/font.hpp"
#include "server/base/check.hpp"

namespace windsplat::annotate {
namespace {

// Glyphs and their clusters: which bytes of the text each glyph stands for.
struct Shaped {
  std::vector<cairo_glyph_t> glyphs;
  std::vector<cairo_text_cluster_t> clusters;
  double width = 0;
};

// The font of this process. FreeType's faces are not for concurrent use, hence the lock.
class Font {
 public:
  Font() {
    const std::span<const unsigned char> bytes = font_bytes();
    WINDSPLAT_CHECK(FT_Init_FreeType(&library_) == 0);
    WINDSPLAT_CHECK(FT_New_Memory_Face(library_, bytes.data(), static_cast<FT_Long>(bytes.size()),
                                       0, &face_) == 0);
    hb_blob_t* const blob = hb_blob_create(reinterpret_cast<const char*>(bytes.data()),
                                           static_cast<unsigned>(bytes.size()),
                                           HB_MEMORY_MODE_READONLY, nullptr, nullptr);
    hb_face_t* const shapes = hb_face_create(blob, 0);
    unit_ = 1.0 / hb_face_get_upem(shapes);
    shaping_ = hb_font_create(shapes);
    hb_face_destroy(shapes);
    hb_blob_destroy(blob);
    drawing_ = cairo_ft_font_face_create_for_ft_face(face_, FT_LOAD_NO_HINTING);
  }
  ~Font() {
    cairo_font_face_destroy(drawing_);
    hb_font_destroy(shaping_);
    FT_Done_Face(face_);
    FT_Done_FreeType(library_);
  }
  Font(const Font&) = delete;
  Font& operator=(const Font&) = delete;

  // Lengths are of an em of 1. Glyphs in visual order, clusters in the same.
  Shaped shape(std::string_view text) {
    const auto buffer = shaped(text);
    unsigned count = 0;
    const hb_glyph_info_t* const info = hb_buffer_get_glyph_infos(buffer.get(), &count);
    const hb_glyph_position_t* const at = hb_buffer_get_glyph_positions(buffer.get(), &count);
    const bool backward = HB_DIRECTION_IS_BACKWARD(hb_buffer_get_direction(buffer.get()));
    Shaped out;
    for (unsigned n = 0; n < count; ++n) {
      out.glyphs.push_back(
          {info[n].codepoint, out.width + unit_ * at[n].x_offset, -unit_ * at[n].y_offset});
      out.width += unit_ * at[n].x_advance;
    }
    if (!backward) set_clusters({info, count}, text.size(), out);
    return out;
  }

  // Empty: all characters have a glyph.
  std::string without_glyph(std::string_view text) {
    const auto buffer = shaped(text);
    unsigned count = 0;
    const hb_glyph_info_t* const info = hb_buffer_get_glyph_infos(buffer.get(), &count);
    for (unsigned n = 0; n < count; ++n) {
      if (info[n].codepoint != 0) continue;
      std::size_t end = info[n].cluster + 1;
      while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) ++end;
      return std::string(text.substr(info[n].cluster, end - info[n].cluster));
    }
    return {};
  }

  std::mutex& mutex() { return mutex_; }
  cairo_font_face_t* drawing() { return drawing_; }

 private:
  using Buffer = std::unique_ptr<hb_buffer_t, decltype(&hb_buffer_destroy)>;

  Buffer shaped(std::string_view text) {
    Buffer buffer(hb_buffer_create(), &hb_buffer_destroy);
    hb_buffer_add_utf8(buffer.get(), text.data(), static_cast<int>(text.size()), 0,
                       static_cast<int>(text.size()));
    hb_buffer_guess_segment_properties(buffer.get());
    hb_shape(shaping_, buffer.get(), nullptr, 0);
    return buffer;
  }
  // Of a text from left to right; HarfBuzz numbers clusters by their first byte.
  static void set_clusters(std::span<const hb_glyph_info_t> info, std::size_t bytes, Shaped& out) {
    for (std::size_t n = 0; n < info.size();) {
      std::size_t next = n;
      while (next < info.size() && info[next].cluster == info[n].cluster) ++next;
      const std::size_t end = next < info.size() ? info[next].cluster : bytes;
      out.clusters.push_back({static_cast<int>(end - info[n].cluster), static_cast<int>(next - n)});
      n = next;
    }
  }

  FT_Library library_ = nullptr;
  FT_Face face_ = nullptr;
  hb_font_t* shaping_ = nullptr;
  double unit_ = 1;  // em of a unit of the font's design
  cairo_font_face_t* drawing_ = nullptr;
  std::mutex mutex_;
};

Font& font() {
  static Font made;
  return made;
}

void set_color(cairo_t* target, const Color& color) {
  cairo_set_source_rgba(target, color.red, color.green, color.blue, color.alpha);
}

}  // namespace

double width_of(std::string_view text, double size) {
  const std::lock_guard lock(font().mutex());
  return size * font().shape(text).width;
}

std::string character_without_glyph(std::string_view text) {
  const std::lock_guard lock(font().mutex());
  return font().without_glyph(text);
}

void draw_text(cairo_t* target, const Text& text) {
  const std::lock_guard lock(font().mutex());
  Shaped shaped = font().shape(text.text);
  const double left = -text.align * text.size * shaped.width;
  cairo_save(target);
  const double x = text.turn == 0 ? text.at.x + left : left;
  const double y = text.turn == 0 ? text.at.y : 0;
  if (text.turn != 0) {
    cairo_translate(target, text.at.x, text.at.y);
    cairo_rotate(target, text.turn);
  }
  for (cairo_glyph_t& glyph : shaped.glyphs) {
    glyph.x = x + text.size * glyph.x;
    glyph.y = y + text.size * glyph.y;
  }
  cairo_set_font_face(target, font().drawing());
  cairo_set_font_size(target, text.size);
  const std::unique_ptr<cairo_font_options_t, decltype(&cairo_font_options_destroy)> options(
      cairo_font_options_create(), &cairo_font_options_destroy);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_set_font_options(target, options.get());
  const int count = static_cast<int>(shaped.glyphs.size());
  if (text.rim.alpha > 0) {
    constexpr double rim_width = 0.22;  // em
    cairo_new_path(target);
    cairo_glyph_path(target, shaped.glyphs.data(), count);
    cairo_set_line_join(target, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(target, rim_width * text.size);
    set_color(target, text.rim);
    cairo_stroke(target);
  }
  set_color(target, text.color);
  if (shaped.clusters.empty()) {
    cairo_show_glyphs(target, shaped.glyphs.data(), count);
  } else {
    cairo_show_text_glyphs(target, text.text.data(), static_cast<int>(text.text.size()),
                           shaped.glyphs.data(), count, shaped.clusters.data(),
                           static_cast<int>(shaped.clusters.size()), {});
  }
  cairo_restore(target);
}

}  // namespace windsplat::annotate
