// Generated scene -> frames of both methods by one and two threads, in turn -> best and median.
#include "tests/bench/scenes/scene_times.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "tests/bench/scenes/scene_set.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/naive_renderer.hpp"

namespace windsplat::bench {
namespace {

double clock_ms(bool processor) {
  timespec now{};
  clock_gettime(processor ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

template <class Call>
double milliseconds(bool processor, const Call& call) {
  const double start = clock_ms(processor);
  call();
  return clock_ms(processor) - start;
}

struct Times {
  std::vector<double> ms;
  [[nodiscard]] double best() const { return *std::min_element(ms.begin(), ms.end()); }
  [[nodiscard]] std::string text() const {
    return number("%.1f", best()) + " / " + number("%.1f", median(ms));
  }
};

constexpr std::array<unsigned, 2> thread_counts_of_scenes{1, 2};

// By method, kernel and slab, and number of threads.
using Measured = std::array<std::array<Times, thread_counts_of_scenes.size()>, 2>;

constexpr std::array methods{protocol::MethodName::kernel, protocol::MethodName::slab};

// Each round has a frame of each kind, so that all have an equal part in a disturbance.
Measured measure(const std::array<scene::Scene, 2>& scenes, const SceneOptions& options,
                 std::size_t thread_kinds) {
  const CancelToken cancel;
  Measured out;
  std::array<std::unique_ptr<ThreadPool>, thread_counts_of_scenes.size()> pools;
  std::array<engine::RenderSpace, 2> spaces;
  for (std::size_t t = 0; t < thread_kinds; ++t) {
    pools[t] = std::make_unique<ThreadPool>(thread_counts_of_scenes[t]);
  }
  for (int round = -1; round < options.rounds; ++round) {
    for (std::size_t t = 0; t < thread_kinds; ++t) {
      for (std::size_t m = 0; m < methods.size(); ++m) {
        engine::WorkReport work;
        const double ms = milliseconds(options.processor_time, [&] {
          work = value_or_give_up(engine::render(scenes[m], *pools[t], cancel, spaces[m]));
        });
        if (work.pixel_updates == 0) give_up("a scene is empty");
        if (round >= 0) out[m][t].ms.push_back(ms);
      }
    }
  }
  return out;
}

std::array<scene::Scene, 2> both_methods(const GeneratedScene& scene, data::Dataset& dataset,
                                         Content content, const Size& size) {
  return {scene_of(scene, dataset, content, size, methods[0]),
          scene_of(scene, dataset, content, size, methods[1])};
}

const char* name_of(Content content) {
  if (content == Content::lines) return "lines";
  return content == Content::medium ? "medium" : "both";
}

// The exponent of a quantity that grows by `ratio` when its cause grows by `cause`.
std::string exponent(double ratio, double cause) {
  return number("%.2f", std::log(ratio) / std::log(cause));
}

class SceneRows {
 public:
  SceneRows(const SceneOptions& options, Table& table) : options_(options), table_(table) {
    sizes_ = {{{640, 480}, {1280, 720}}};
    if (options.smoke) sizes_ = {{{48, 32}, {96, 64}}};
  }

  void add(const GeneratedScene& scene) {
    std::fprintf(stderr, "%s\n", scene.name.c_str());
    const int reduction = options_.smoke ? 8 : 1;
    // By content, kernel and slab, for the smaller picture.
    std::vector<std::array<double, 2>> eighth;
    {
      const auto dataset = scene.open(2 * reduction);
      for (const Content content : scene.contents) {
        const auto measured =
            measure(both_methods(scene, *dataset, content, sizes_[0]), options_, 1);
        eighth.push_back({measured[0][0].best(), measured[1][0].best()});
      }
    }
    const auto dataset = scene.open(reduction);
    for (std::size_t c = 0; c < scene.contents.size(); ++c) {
      if (!options_.content.empty() && options_.content != name_of(scene.contents[c])) continue;
      add(scene, *dataset, scene.contents[c], eighth[c]);
    }
  }

 private:
  void add(const GeneratedScene& scene, data::Dataset& dataset, Content content,
           const std::array<double, 2>& eighth) {
    std::optional<Measured> smaller;
    for (const Size& size : sizes_) {
      const auto scenes = both_methods(scene, dataset, content, size);
      const Measured now = measure(scenes, options_, thread_counts_of_scenes.size());
      const double kernel = now[0][0].best();
      const double slab = now[1][0].best();
      Row row{scene.name, name_of(content),
              std::to_string(size.width) + "x" + std::to_string(size.height)};
      for (const auto& method : now) {
        for (const Times& times : method) row.push_back(times.text());
      }
      const bool naive = scene.naive && options_.naive;
      const auto draw_naively = [&] { naive::render<float>(scenes[0]); };
      row.push_back(
          naive ? number("%.1f", milliseconds(options_.processor_time, draw_naively) / kernel)
                : "");
      row.push_back(number("%.2f", slab / kernel));
      row.push_back(number("%.2f", kernel / now[0][1].best()));
      row.push_back(number("%.2f", slab / now[1][1].best()));
      if (!smaller) {
        for (std::size_t m = 0; m < 2; ++m)
          row.push_back(exponent(now[m][0].best() / eighth[m], 8));
        row.insert(row.end(), {"", ""});
        smaller = now;
      } else {
        row.insert(row.end(), {"", ""});
        const double pixels = static_cast<double>(size.width) * size.height /
                              (static_cast<double>(sizes_[0].width) * sizes_[0].height);
        for (std::size_t m = 0; m < 2; ++m) {
          row.push_back(exponent(now[m][0].best() / (*smaller)[m][0].best(), pixels));
        }
      }
      table_.push_back(std::move(row));
    }
  }

  const SceneOptions& options_;
  Table& table_;
  std::array<Size, 2> sizes_;
};

}  // namespace

Table scene_times(const SceneOptions& options) {
  Table table{{"scene", "content", "size", "kernel 1", "kernel 2", "slab 1", "slab 2",
               "naive/kernel", "slab/kernel", "kernel 1/2", "slab 1/2", "kernel samples^",
               "slab samples^", "kernel pixels^", "slab pixels^"}};
  SceneRows rows(options, table);
  for (const GeneratedScene& scene : generated_scenes(options.smoke ? 64 : options.side)) {
    if (scene.name.find(options.only) != std::string::npos) rows.add(scene);
  }
  return table;
}

}  // namespace windsplat::bench
