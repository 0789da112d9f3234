// How well pictures show which end of a line is its head, and which of two crossing lines is in
// front, for every mark of lines (docs/benchmarks/direction.md):
//
//   bench_direction [--files=A,B] [--side=N] [--smoke]
//
// Pictures are drawn without media. The lines of a picture are known from the scene; of each an
// estimator gets the axis without its direction, and the picture. One rule for each mark and
// background is learnt on formulas; other formulas, or the files, judge it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "server/scene/build.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/lines/mark.hpp"
#include "tests/bench/direction/cues.hpp"
#include "tests/bench/direction/fields.hpp"
#include "tests/bench/direction/tally.hpp"
#include "tests/bench/direction/truth.hpp"
#include "tests/bench/support.hpp"

namespace windsplat::bench {
namespace {

using protocol::MarkShape;

struct Mark {
  const char* name;
  MarkShape shape;
  double whitening;
  double darkening;
  double halo;
};

// Differences are those from the first.
constexpr std::array<Mark, 12> marks{
    {{"white head", MarkShape::line, 0.7, 0, 0},
     {"none", MarkShape::line, 0, 0, 0},
     {"white head, tail 0.5", MarkShape::line, 0.7, 0.5, 0},
     {"white head, tail 0.85", MarkShape::line, 0.7, 0.85, 0},
     {"comet", MarkShape::comet, 0, 0.85, 0},
     {"taper, white head", MarkShape::taper, 0.7, 0, 0},
     {"taper, white head, tail 0.5", MarkShape::taper, 0.7, 0.5, 0},
     {"arrow, white head", MarkShape::arrow, 0.7, 0, 0},
     {"white head, halo 1", MarkShape::line, 0.7, 0, 1},
     {"white head, halo 2", MarkShape::line, 0.7, 0, 2},
     {"white head, tail 0.5, halo 1", MarkShape::line, 0.7, 0.5, 1},
     {"comet, halo 1", MarkShape::comet, 0, 0.85, 1}}};

struct Look {
  int width;
  const char* map;
  const char* background;
};

constexpr const char* dark = "#000000";
constexpr const char* light = "#ffffff";
constexpr int map_width = 800;  // pixels, of pictures with other maps than the default
constexpr std::array<int, 4> widths{400, 800, 1400, 2000};
constexpr std::array<const char*, 6> maps{"viridis", "magma", "cividis",
                                          "clouds",  "ice",   "coolwarm"};
// Nothing is learnt on these.
constexpr std::array<const char*, 7> new_maps{"inferno", "plasma",   "sunset", "compass",
                                              "moss",    "tealrose", "grays"};

std::vector<Look> looks(bool smoke, bool learnt) {
  if (smoke) return {{widths[0], maps[0], dark}, {widths[0], maps[0], light}};
  std::vector<Look> out;
  out.reserve(widths.size() + 2 * maps.size() + new_maps.size());
  for (const int width : widths) out.push_back({width, maps[0], dark});
  for (const char* const map : maps) {
    if (map != maps[0]) out.push_back({map_width, map, dark});
    out.push_back({map_width, map, light});
  }
  if (learnt) return out;
  for (const char* const map : new_maps) out.push_back({map_width, map, dark});
  return out;
}

bool is_new(const char* map) {
  return std::find(new_maps.begin(), new_maps.end(), map) != new_maps.end();
}

bool shows_white_heads(const char* map) {
  protocol::VectorColorView color;
  color.map = map;
  return scene::shows_white_heads(color);
}

// Those of which totals are printed.
constexpr const char* shown_old = "over black, whitening is seen";
constexpr const char* pale_old = "over black, whitening is hardly seen";
constexpr const char* shown_new = "over black, whitening is seen, maps that nothing is learnt on";
constexpr const char* pale_new =
    "over black, whitening is hardly seen, maps that nothing is learnt on";
constexpr const char* over_white = "over white";

std::string total_of(const Look& look) {
  if (look.background != dark) return over_white;
  const bool shown = shows_white_heads(look.map);
  if (is_new(look.map)) return shown ? shown_new : pale_new;
  return shown ? shown_old : pale_old;
}

// The groups in which a picture is counted.
std::vector<std::string> groups_of(const Look& look) {
  const bool on_dark = look.background == dark;
  std::vector<std::string> groups{"all", total_of(look)};
  if (on_dark && look.map == maps[0]) groups.push_back("width " + std::to_string(look.width));
  if (look.width != map_width) return groups;
  groups.push_back(std::string(look.map) + (on_dark ? "" : ", white"));
  return groups;
}

struct Rules {
  Rule<direction_cues> direction;
  Rule<depth_cues> order;
};

class Measure {
 public:
  Measure(int side, bool smoke) : side_(side), smoke_(smoke) {}

  void look_at(const DirectionField& field) {
    const auto dataset = dataset_of(field, side_);
    for (const Look& look : looks(smoke_, field.learnt)) {
      // The same lines with their ends exchanged: what else differs along them, as light or
      // height, tells nothing about their direction.
      for (const double sign : {1.0, -1.0}) look_once(field, look, sign, *dataset);
    }
    std::fprintf(stderr, "%s\n", field.name.c_str());
  }

  void fit() {
    for (auto& [key, rules] : rules_) {
      rules.direction.fit();
      rules.order.fit();
    }
  }

  [[nodiscard]] const Shares& shares(const Mark& mark, Question question,
                                     const std::string& group) const {
    static const Shares none;
    const auto at = shares_.find({mark.name, question, group});
    return at == shares_.end() ? none : at->second;
  }

  // Lines, lines alone and crossings that were asked about for each mark.
  [[nodiscard]] std::array<double, 3> asked() const {
    std::array<double, 3> out{};
    for (std::size_t n = 0; n < out.size(); ++n) {
      for (const auto& [field, share] : shares(marks[0], static_cast<Question>(n), "all")) {
        out[n] += share.count;
      }
    }
    return out;
  }

 private:
  using Key = std::pair<std::string, std::string>;

  static scene::Scene scene_of(const protocol::View& view, data::Dataset& dataset) {
    const auto completed = value_or_give_up(scene::complete(view, dataset));
    return value_or_give_up(scene::build_scene(completed, dataset));
  }

  static void set_mark(const Mark& mark, protocol::VectorView& vector) {
    vector.mark.shape = mark.shape;
    vector.mark.tail_darkening = mark.darkening;
    vector.mark.halo = mark.halo;
    vector.head_desaturation = mark.whitening;
  }

  void look_once(const DirectionField& field, const Look& look, double sign,
                 data::Dataset& dataset) {
    protocol::View view;
    view.image.width = look.width;
    view.image.height = look.width * 9 / 16;
    view.image.background = look.background;
    view.scalars.emplace();
    view.vector.scale = {sign, sign, sign};
    view.vector.color.map = look.map;
    view.method.detail = protocol::Detail::full;
    set_mark(marks[1], view.vector);
    const scene::Scene plain = scene_of(view, dataset);
    const std::string name = field.name + std::to_string(look.width) + (sign > 0 ? "+" : "-");
    if (!truths_.contains(name)) truths_[name] = truth_of(plain);
    const Truth& truth = truths_[name];
    const auto background = scene::parse_color(look.background).value();
    for (const Mark& mark : marks) {
      set_mark(mark, view.vector);
      const auto drawn = value_or_give_up(engine::render(scene_of(view, dataset), pool_, {}));
      const LabPicture picture(drawn.image, background);
      Rules& rules = rules_[{mark.name, look.background}];
      if (field.learnt) {
        learn(truth, picture, rules);
      } else {
        judge(truth, picture, rules, [&](Question question, double value) {
          for (const std::string& group : groups_of(look)) {
            shares_[{mark.name, question, group}][field.name].add(value);
          }
        });
      }
    }
  }

  static void learn(const Truth& truth, const LabPicture& picture, Rules& rules) {
    for (const SeenLine& line : truth.lines) {
      rules.direction.learn(direction_of(picture, line.axis));
    }
    for (const Crossing& at : truth.crossings) {
      rules.order.learn(order_of(picture, at.front, at.behind, at.x, at.y));
    }
  }

  template <class Count>
  static void judge(const Truth& truth, const LabPicture& picture, const Rules& rules,
                    const Count& count) {
    for (const SeenLine& line : truth.lines) {
      const double right = rules.direction.right(direction_of(picture, line.axis));
      count(Question::direction, 100 * right);
      if (!line.alone) continue;
      count(Question::direction_alone, 100 * right);
      count(Question::contrast, contrast_of(picture, line.axis));
    }
    for (const Crossing& at : truth.crossings) {
      const double right = rules.order.right(order_of(picture, at.front, at.behind, at.x, at.y));
      count(Question::order, 100 * right);
    }
  }

  int side_;
  bool smoke_;
  ThreadPool pool_{0};
  std::map<std::string, Truth> truths_;
  std::map<Key, Rules> rules_;  // by mark and background
  std::map<std::tuple<std::string, Question, std::string>, Shares> shares_;
};

void print_row(const std::vector<std::string>& cells) {
  for (const std::string& cell : cells) std::printf("| %s ", cell.c_str());
  std::printf("|\n");
}

void print_head(const std::vector<std::string>& cells) {
  print_row(cells);
  for (std::size_t n = 0; n < cells.size(); ++n) std::printf("|---");
  std::printf("|\n");
}

std::string text_of(double value, const char* format = "%.0f") {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return std::isnan(value) ? "-" : text.data();
}

std::string text_of(const Estimate& difference) {
  return text_of(difference.mean, "%+.1f") + " (" + text_of(difference.low, "%+.1f") + " to " +
         text_of(difference.high, "%+.1f") + ")";
}

void print_totals(const Measure& measure) {
  const auto [lines, alone, crossings] = measure.asked();
  std::printf("Asked about %.0f lines, %.0f of them alone, and %.0f crossings for each mark.\n",
              lines, alone, crossings);
  for (const char* const group : {shown_old, pale_old, shown_new, pale_new, over_white}) {
    std::printf("\n%% right %s, and the difference from \"%s\" (95 %% of resamples of fields)\n\n",
                group, marks[0].name);
    print_head({"mark", "direction", "difference", "alone", "in front", "difference"});
    for (const Mark& mark : marks) {
      const auto mean = [&](Question question) {
        return text_of(mean_of(measure.shares(mark, question, group)).mean, "%.1f");
      };
      const auto difference = [&](Question question) {
        return text_of(difference_of(measure.shares(mark, question, group),
                                     measure.shares(marks[0], question, group)));
      };
      print_row({mark.name, mean(Question::direction), difference(Question::direction),
                 mean(Question::direction_alone), mean(Question::order),
                 difference(Question::order)});
    }
  }
}

void print_groups(const Measure& measure, const char* title, Question question,
                  const std::vector<std::string>& groups) {
  std::printf("\n%s\n\n", title);
  std::vector<std::string> head{"mark"};
  head.insert(head.end(), groups.begin(), groups.end());
  print_head(head);
  for (const Mark& mark : marks) {
    std::vector<std::string> cells{mark.name};
    for (const std::string& group : groups) {
      cells.push_back(text_of(mean_of(measure.shares(mark, question, group)).mean));
    }
    print_row(cells);
  }
}

void print_fields(const Measure& measure, const char* title, Question question,
                  const std::vector<DirectionField>& fields) {
  std::printf("\n%s\n\n", title);
  std::vector<std::string> head{"mark"};
  for (const DirectionField& field : fields) {
    head.push_back(field.name.substr(field.name.rfind('/') + 1));
  }
  print_head(head);
  for (const Mark& mark : marks) {
    std::vector<std::string> cells{mark.name};
    const Shares& shares = measure.shares(mark, question, "all");
    for (const DirectionField& field : fields) {
      const auto at = shares.find(field.name);
      cells.push_back(at == shares.end() ? "-" : text_of(at->second.sum / at->second.count));
    }
    print_row(cells);
  }
}

void print_all(const Measure& measure, const std::vector<DirectionField>& judges) {
  print_totals(measure);
  std::vector<std::string> sizes;
  sizes.reserve(widths.size());
  for (const int width : widths) sizes.push_back("width " + std::to_string(width));
  std::vector<std::string> colors;
  colors.reserve(2 * maps.size() + new_maps.size());
  for (const char* const map : maps) colors.emplace_back(map);
  for (const char* const map : new_maps) colors.emplace_back(map);
  for (const char* const map : maps) colors.push_back(std::string(map) + ", white");
  print_groups(measure, "Direction, % right, by width", Question::direction, sizes);
  print_groups(measure, "In front, % right, by width", Question::order, sizes);
  print_groups(measure, "Direction, % right, by map and background", Question::direction, colors);
  print_groups(measure, "In front, % right, by map and background", Question::order, colors);
  print_groups(measure, "Contrast of head and tail, CIELAB", Question::contrast, colors);
  print_fields(measure, "Direction, % right, by field", Question::direction, judges);
  print_fields(measure, "In front, % right, by field", Question::order, judges);
}

std::vector<DirectionField> judges_of(const std::string& files) {
  std::vector<DirectionField> out;
  if (files.empty()) {
    for (const DirectionField& field : formula_fields()) {
      if (!field.learnt) out.push_back(field);
    }
  }
  std::istringstream paths(files);
  for (std::string path; std::getline(paths, path, ',');) out.push_back({path, false, true});
  return out;
}

int run(int argc, char** argv) {
  const bool smoke = !take_option(argc, argv, "--smoke").empty();
  const std::string files = take_option(argc, argv, "--files");
  const std::string side = take_option(argc, argv, "--side");
  if (argc > 1) give_up(std::string("unknown option ") + argv[1]);
  constexpr int default_side = 12;
  constexpr int smoke_side = 6;
  const int samples = smoke ? smoke_side : default_side;
  Measure measure(side.empty() ? samples : std::stoi(side), smoke);
  for (const DirectionField& field : formula_fields()) {
    if (field.learnt) measure.look_at(field);
  }
  measure.fit();
  const std::vector<DirectionField> judges = judges_of(files);
  for (const DirectionField& field : judges) measure.look_at(field);
  print_all(measure, judges);
  return 0;
}

}  // namespace
}  // namespace windsplat::bench

int main(int argc, char** argv) { return windsplat::bench::run(argc, argv); }
