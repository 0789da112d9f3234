// A calibration -> its plot and its part of the page.
#include <algorithm>
#include <array>
#include <cmath>

#include "server/quality/laws.hpp"
#include "server/study/report.hpp"
#include "server/study/svg.hpp"

namespace windsplat::study {

namespace {

// Pixels of the drawing.
constexpr double width = 980;
constexpr double height = 560;
constexpr double left = 70;
constexpr double right = 530;
constexpr double top = 40;
constexpr double bottom = 500;
constexpr double legend_left = 560;
constexpr double legend_step = 18;
constexpr const char* measured_color = "#111111";

const char* color_of(SettingClass kind) {
  switch (kind) {
    case SettingClass::kernel:
      return "#d1421f";
    case SettingClass::kernel_smaller:
      return "#e39a1d";
    case SettingClass::kernel_coarser:
      return "#b0478f";
    case SettingClass::slab:
      return "#1f5fbf";
    case SettingClass::slab_smaller:
      return "#17a2b8";
    case SettingClass::slab_coarser:
      return "#6f5bd0";
  }
  return "#000000";
}

Agreement of_class(const Calibration& calibration, SettingClass kind) {
  return agreement(calibration, [kind](const Compared& one) {
    return class_of(quality::settings[one.setting]) == kind;
  });
}

Agreement of_look(const Calibration& calibration, std::size_t look) {
  return agreement(calibration, [look](const Compared& one) { return one.look == look; });
}

std::string percent(double share) { return format_number("%.1f %%", 100 * share); }

class Plot {
 public:
  explicit Plot(const SceneReport& scene) : scene_(scene), calibration_(*scene.calibration) {
    double low = 1;
    double high = quality::error_least;
    const auto reach = [&](double error) {
      if (!drawable(error)) return;
      low = std::min(low, std::max(error, quality::error_least));
      high = std::max(high, error);
    };
    for (const Compared& one : calibration_.compared) {
      reach(one.error);
      reach(one.forecast.error);
    }
    for (const MeasuredFrame& one : calibration_.measured) {
      reach(one.error);
      reach(one.measured);
    }
    x_ = make_axis(low, high, left, right);
    y_ = make_axis(low, high, bottom, top);
  }

  std::string svg() {
    text_ = svg_head(width, height, scene_.name + ": errors told against true errors");
    band();
    text_ += axes(x_, y_, "%.0e");
    words();
    for (const Compared& one : calibration_.compared) {
      const char* const color = color_of(class_of(quality::settings[one.setting]));
      dot(one.error, one.forecast.error, " r=\"2.4\" fill-opacity=\"0.6\" fill=\"", color);
    }
    for (const MeasuredFrame& one : calibration_.measured) {
      dot(one.error, one.measured, " r=\"4\" fill=\"none\" stroke=\"", measured_color);
    }
    legend();
    text_ += "</svg>\n";
    return std::move(text_);
  }

 private:
  // Within a factor of 2: between two parallels of the diagonal.
  void band() {
    const double low = x_.low;
    const double high = x_.high;
    const std::array<std::array<double, 2>, 6> corners{{{low, low},
                                                        {low, 2 * low},
                                                        {high / 2, high},
                                                        {high, high},
                                                        {high, high / 2},
                                                        {2 * low, low}}};
    std::string path;
    for (const auto& [x, y] : corners) {
      path += path.empty() ? 'M' : 'L';
      path += number(x_.at(x)) + " " + number(y_.at(y)) + " ";
    }
    text_ += "<path d=\"" + path + "Z\" fill=\"#eef3e6\"/>\n";
    text_ += line(left, bottom, right, top, "stroke:#9aa88a");
  }

  void words() {
    text_ += label(left, top - 14, scene_.name + ": told against true",
                   " font-size=\"16\" font-weight=\"bold\"");
    text_ += label((left + right) / 2, bottom + 40, "true error, RMS of linear RGBA",
                   " text-anchor=\"middle\"");
    text_ += "<text transform=\"translate(18 " + number((top + bottom) / 2);
    text_ += ") rotate(-90)\" text-anchor=\"middle\">error told</text>\n";
  }

  void dot(double error, double told, const char* how, const char* color) {
    text_ += "<circle" + attribute("cx", x_.at(error)) + attribute("cy", y_.at(told));
    text_ += joined({how, color, "\"/>\n"});
  }

  void entry(const Agreement& of, const std::string& name, const char* how, const char* color) {
    if (of.count == 0) return;
    text_ += "<circle" + attribute("cx", legend_left + 6) + attribute("cy", legend_ - 4);
    text_ += joined({how, color, "\"/>\n"});
    std::string says = name;
    says += ": ";
    says += percent(of.within_two) + " of " + std::to_string(of.count);
    says += ", median " + format_number("%.2f", of.median);
    text_ += label(legend_left + 20, legend_, says, " font-size=\"11.5\"");
    legend_ += legend_step;
  }

  void legend() {
    text_ += label(legend_left, legend_, "within a factor of 2 of the truth (the band):");
    legend_ += legend_step;
    for (const SettingClass kind : setting_classes) {
      entry(of_class(calibration_, kind), name_of(kind), " r=\"4\" fill=\"", color_of(kind));
    }
    entry(agreement_of_measured(calibration_), "measured by a finer run",
          " r=\"4\" fill=\"none\" stroke=\"", measured_color);
    legend_ += legend_step / 2;
    for (std::size_t look = 0; look < calibration_.looks.size(); ++look) {
      const Agreement of = of_look(calibration_, look);
      text_ += label(legend_left, legend_,
                     calibration_.looks[look] + ": " + percent(of.within_two) + " of " +
                         std::to_string(of.count),
                     " fill=\"#555555\" font-size=\"11\"");
      legend_ += legend_step - 2;
    }
  }

  const SceneReport& scene_;
  const Calibration& calibration_;
  LogAxis x_;
  LogAxis y_;
  double legend_ = top + 8;
  std::string text_;
};

void row(std::string& text, const std::string& name, const Agreement& of, bool has_bound) {
  if (of.count == 0) return;
  text += "<tr><td>" + escaped(name) + "</td><td>" + std::to_string(of.count);
  text += "</td><td>" + percent(of.within_two) + "</td><td>" + format_number("%.2f", of.median);
  text += "</td><td>";
  if (has_bound) text += percent(of.bounded);
  text += "</td></tr>\n";
}

std::string agreement_table(const Calibration& calibration) {
  std::string text =
      "<table><tr><th>errors told</th><th>compared</th><th>within a factor of 2</th>"
      "<th>median of told over true</th><th>within the bound</th></tr>\n";
  row(text, "estimated, all", agreement(calibration), true);
  for (const SettingClass kind : setting_classes) {
    row(text, name_of(kind), of_class(calibration, kind), true);
  }
  for (std::size_t look = 0; look < calibration.looks.size(); ++look) {
    row(text, calibration.looks[look], of_look(calibration, look), true);
  }
  row(text, "nothing surveyed yet", agreement_of_priors(calibration), true);
  row(text, "measured by a finer run", agreement_of_measured(calibration), false);
  row(text, "of JPEG, one measured", agreement_of_encodings(calibration), false);
  return text + "</table>\n";
}

std::string aims_table(const Calibration& calibration) {
  std::string text =
      "<table><tr><th>maxError</th><th>frames</th><th>forecast to keep it</th>"
      "<th>of them kept it</th><th>possible</th><th>of them kept it</th></tr>\n";
  const auto share = [](std::size_t n, std::size_t of) {
    return of == 0 ? std::string("-") : percent(static_cast<double>(n) / static_cast<double>(of));
  };
  for (const Aimed& aimed : calibration.aimed) {
    text += "<tr><td>" + format_number("%g", aimed.max_error) + "</td><td>";
    text += std::to_string(aimed.frames) + "</td><td>" + std::to_string(aimed.promised);
    text += "</td><td>" + share(aimed.promised_kept, aimed.promised) + "</td><td>";
    text += std::to_string(aimed.possible) + "</td><td>";
    text += share(aimed.possible_kept, aimed.possible) + "</td></tr>\n";
  }
  return text + "</table>\n";
}

}  // namespace

std::string calibration_svg(const SceneReport& scene) {
  return scene.calibration ? Plot(scene).svg() : std::string();
}

std::string calibration_section(const SceneReport& scene) {
  if (!scene.calibration) return {};
  const Calibration& calibration = *scene.calibration;
  const CalibrationPlan& plan = calibration.plan;
  std::string text = "<h3>Are the errors that frames are told true?</h3>\n<p>Of each of ";
  text += std::to_string(calibration.looks.size()) + " looks ";
  text += std::to_string(plan.surveyed) + " views were surveyed and ";
  text += std::to_string(plan.held_out) + " others drawn at every setting, ";
  text += std::to_string(plan.width) + " x " + std::to_string(plan.height);
  text +=
      " pixels, any azimuth, zoom 0.6 to 4, against a truth extrapolated from slabs of 1/4 and 1/8 "
      "of a cell.";
  for (const TruthCheck& check : calibration.checks) {
    text += " Of " + escaped(calibration.looks[check.look]) + " it is ";
    text += format_number("%.1e", check.apart) + " apart from the integral (it says ";
    text += format_number("%.1e", check.estimate) + ").";
  }
  text += "</p>\n<div class=\"plot\">" + calibration_svg(scene) + "</div>\n";
  return text + agreement_table(calibration) + aims_table(calibration);
}

}  // namespace windsplat::study
