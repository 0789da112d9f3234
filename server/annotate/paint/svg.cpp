#include <openssl/evp.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/annotate/paint/document.hpp"
#include "server/annotate/paint/type.hpp"

namespace windsplat::annotate {
namespace {

std::string base64(const image::Bytes& bytes) {
  std::string out(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()), bytes.data(),
                                     static_cast<int>(bytes.size()));
  out.resize(static_cast<std::size_t>(length));
  return out;
}

// Two decimals are a hundredth of a pixel.
std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f", std::isfinite(value) ? value : 0.0);
  return text.data();
}

std::string hex(const Color& color) {
  std::array<char, 8> text{};
  const auto code = [](double value) { return static_cast<unsigned>(std::lround(255 * value)); };
  std::snprintf(text.data(), text.size(), "#%02x%02x%02x", code(color.red) & 255U,
                code(color.green) & 255U, code(color.blue) & 255U);
  return text.data();
}

// Characters that XML 1.0 does not allow become spaces.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (static_cast<unsigned char>(c) < ' ') {
      out += ' ';
    } else {
      out += c;
    }
  }
  return out;
}

class Writer {
 public:
  explicit Writer(std::string& out) : out_(out) {}

  void operator()(const Line& line) {
    out_ += "<polyline fill=\"none\" stroke-linecap=\"round\" stroke-linejoin=\"round\"" +
            paint("stroke", line.color) + " stroke-width=\"" + number(line.width) + "\"" +
            points(line.points) + "/>\n";
  }
  void operator()(const Area& area) {
    out_ += "<polygon" + paint("fill", area.color) + points(area.points) + "/>\n";
  }
  void operator()(const Strip& strip) {
    const std::string id = "colors" + std::to_string(strips_++);
    out_ += "<linearGradient id=\"" + id + "\">";
    const double last = strip.colors.size() > 1 ? static_cast<double>(strip.colors.size() - 1) : 1;
    for (std::size_t n = 0; n < strip.colors.size(); ++n) {
      std::array<char, 32> offset{};
      std::snprintf(offset.data(), offset.size(), "%.5f", static_cast<double>(n) / last);
      out_ += "<stop offset=\"" + std::string(offset.data()) + "\" stop-color=\"" +
              hex(strip.colors[n]) + "\"/>";
    }
    out_ += "</linearGradient>\n<rect x=\"" + number(strip.corner.x) + "\" y=\"" +
            number(strip.corner.y) + "\" width=\"" + number(strip.width) + "\" height=\"" +
            number(strip.height) + "\" fill=\"url(#" + id + ")\"/>\n";
  }
  void operator()(const Text& text) {
    // SVG aligns in three ways only; the rest is a shift.
    const double align = text.align <= 0.25 ? 0 : text.align >= 0.75 ? 1 : 0.5;
    const std::string anchor = align == 0 ? "start" : align == 1 ? "end" : "middle";
    const double shift =
        align == text.align ? 0 : (align - text.align) * width_of(text.text, text.size);
    constexpr double rim_width = 0.22;  // em
    const std::string rim = text.rim.alpha > 0
                                ? paint("stroke", text.rim) + " stroke-width=\"" +
                                      number(rim_width * text.size) +
                                      "\" stroke-linejoin=\"round\" paint-order=\"stroke\""
                                : std::string();
    out_ += "<text x=\"" + number(text.at.x + shift) + "\" y=\"" + number(text.at.y) +
            "\" font-size=\"" + number(text.size) + "\" text-anchor=\"" + anchor +
            "\" xml:space=\"preserve\"" + turned(text) + rim + paint("fill", text.color) + ">" +
            escaped(text.text) + "</text>\n";
  }

 private:
  static std::string turned(const Text& text) {
    if (text.turn == 0) return {};
    return " transform=\"rotate(" + number(text.turn * 180 / std::numbers::pi) + " " +
           number(text.at.x) + " " + number(text.at.y) + ")\"";
  }
  static std::string paint(const std::string& what, const Color& color) {
    std::string out = " " + what + "=\"" + hex(color) + "\"";
    if (color.alpha < 1) out += " " + what + "-opacity=\"" + number(color.alpha) + "\"";
    return out;
  }
  static std::string points(const std::vector<Point>& points) {
    std::string out = " points=\"";
    for (const Point& point : points) out += number(point.x) + "," + number(point.y) + " ";
    out.back() = '"';
    return out;
  }

  std::string& out_;
  int strips_ = 0;
};

}  // namespace

Result<image::Bytes> encode_svg(const Page& page) {
  const auto png = image::encode_png(page.rgb, page.width, page.height);
  if (!png) return png.error();
  const std::string width = std::to_string(page.width);
  const std::string height = std::to_string(page.height);
  std::string out =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
      "width=\"" +
      number(page.width / page.dots_per_inch) + "in\" height=\"" +
      number(page.height / page.dots_per_inch) + "in\" viewBox=\"0 0 " + width + " " + height +
      "\" font-family=\"'DejaVu Sans', Verdana, sans-serif\">\n<image width=\"" + width +
      "\" height=\"" + height + "\" xlink:href=\"data:image/png;base64," + base64(*png) + "\"/>\n";
  Writer writer(out);
  for (const Part& part : page.parts) {
    const bool narrower = part.figure.width < page.width;
    // A viewport of its own, which clips (SVG 1.1, 14.3.3).
    if (narrower) {
      out += "<svg x=\"" + std::to_string(part.left) + "\" y=\"0\" width=\"" +
             std::to_string(part.figure.width) + "\" height=\"" +
             std::to_string(part.figure.height) + "\" overflow=\"hidden\">\n";
    }
    for (const Item& item : part.figure.above) std::visit(writer, item);
    if (narrower) out += "</svg>\n";
  }
  out += "</svg>\n";
  return image::Bytes(out.begin(), out.end());
}

Result<image::Bytes> encode_svg(std::span<const std::uint8_t> rgb, const Figure& figure,
                                double dots_per_inch) {
  const Part whole{figure};
  return encode_svg({rgb, figure.width, figure.height, {&whole, 1}, dots_per_inch});
}

}  // namespace windsplat::annotate
