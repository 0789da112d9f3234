// Report -> study.json, study.csv and the page, written into a folder.
#include "server/study/report/report.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/whole_file.hpp"
#include "server/study/report/document.hpp"
#include "server/study/report/extremes_text.hpp"
#include "server/study/report/template.hpp"

namespace windsplat::study {

std::string report_json(const Report& report) {
  return protocol::encode_study(document_of(report));
}

std::string report_csv(const Report& report) {
  std::string text =
      "scene,method,compositing,stride,span,slabThickness,stopTransmittance,width,"
      "rmse,max,psnr,flip,ms,msMin,msMax,pareto,stable\n";
  for (const SceneReport& scene : report.scenes) {
    for (const Point& point : scene.points) {
      text += csv_text(scene.name);
      text += ',';
      text += name_of(point.setting.method);
      text += ',';
      text += name_of(point.setting.compositing);
      for (const Knob knob : report_knobs) {
        text += ',';
        if (has_knob(scene, point.setting, knob)) {
          text += format_number("%.6g", value_of(point.setting.knobs, knob));
        }
      }
      const Measurement& m = point.measured;
      for (const double v : {m.rmse, m.max, m.psnr, m.flip, m.ms, m.ms_min, m.ms_max}) {
        text += ',';
        if (std::isfinite(v)) text += format_number("%.6g", v);
      }
      text += point.pareto ? ",1" : ",0";
      text += m.stable ? ",1\n" : ",0\n";
    }
  }
  return text;
}

Result<std::string> report_page(const Report& report) {
  protocol::StudyDocument document = document_of(report);
  for (std::size_t i = 0; i < report.scenes.size(); ++i) {
    auto pictures = encoded_pictures(report.scenes[i]);
    if (!pictures) return pictures.error();
    document.scenes[i].pictures = std::move(*pictures);
  }
  constexpr std::string_view marker = "%STUDY%";
  const std::string_view page = report_template();
  const std::size_t at = page.find(marker);
  WINDSPLAT_CHECK(at != std::string_view::npos);
  std::string text(page.substr(0, at));
  // In JSON '<' occurs only within strings. It is escaped, so that no text can end the script
  // element.
  for (const char c : protocol::encode_study(document, true)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text.append(page.substr(at + marker.size()));
}

Result<void> write_report(const Report& report, const std::filesystem::path& folder) {
  const auto page = report_page(report);
  if (!page) return page.error();
  auto csv = report.extremes
                 ? write_whole_file(folder / "extremes.csv", extremes_csv(*report.extremes))
                 : write_whole_file(folder / "study.csv", report_csv(report));
  if (!csv) return csv;
  if (auto done = write_whole_file(folder / "study.json", report_json(report)); !done) return done;
  return write_whole_file(folder / "index.html", *page);
}

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted(1, '"');
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

std::string format_number(const char* format, double value) {
  if (std::isnan(value)) return "-";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace windsplat::study
