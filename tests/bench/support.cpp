// Workload -> dataset -> view -> scene, and the description of the machine.
#include "tests/bench/support.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/data/samples/samples.hpp"
#include "server/engine/kernels/dispatch.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/place.hpp"
#include "server/scene/presets.hpp"

namespace windsplat::bench {

void give_up(const std::string& message) {
  std::fprintf(stderr, "benchmark: %s\n", message.c_str());
  std::exit(1);  // NOLINT(concurrency-mt-unsafe)
}

data::Dataset& dataset_of(const Sample& sample) {
  static std::unique_ptr<data::Dataset> open;
  static Sample which{""};
  if (!open || std::string(which.name) != sample.name || which.dims != sample.dims) {
    open.reset();
    constexpr std::uint64_t bytes_max = std::uint64_t{4} << 30U;
    open = std::make_unique<data::Dataset>(
        value_or_give_up(data::open_sample(sample.name, sample.dims, 1)), sample.name, bytes_max);
    which = sample;
  }
  return *open;
}

protocol::View view_of(const Workload& workload) {
  data::Dataset& dataset = dataset_of(workload.sample);
  protocol::View view;
  view.dataset = dataset.info().id;
  view.image.width = workload.width;
  view.image.height = workload.height;
  view.vector.stride = 1;  // every sample, whatever the defaults
  // Must precede the computation of defaults, so that hidden fields are never loaded.
  const std::string preset = workload.preset;
  if (preset == "clouds") view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view = value_or_give_up(scene::complete(view, dataset)).view();
  const auto placed = value_or_give_up(scene::place_dataset(view.geometry, dataset));
  if (auto done = scene::apply_preset(view, placed->lattice, preset); !done) {
    give_up(done.error().message);
  }
  scene::orbit(view, placed->lattice, 20, 35, 1);
  view.method.name = workload.method;
  view.method.detail = workload.detail;
  if (workload.every_line && view.vector.magnitude_range) {
    view.vector.min_magnitude = 1e-3 * (*view.vector.magnitude_range)[1];
  }
  return view;
}

void turn(protocol::View& view, const Workload& workload, double azimuth) {
  const auto placed =
      value_or_give_up(scene::place_dataset(view.geometry, dataset_of(workload.sample)));
  scene::orbit(view, placed->lattice, azimuth, 35, 1);
}

scene::Scene scene_of(const Workload& workload) {
  return value_or_give_up(scene::build_scene(view_of(workload), dataset_of(workload.sample)));
}

std::vector<unsigned> thread_counts() {
  const unsigned most = std::max(1U, std::thread::hardware_concurrency());
  std::vector<unsigned> counts;
  for (unsigned n = 1; n < most; n *= 2) counts.push_back(n);
  counts.push_back(most);
  return counts;
}

namespace {

// The value after the colon of the first line with this prefix.
std::string line_of(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    if (line.rfind(key, 0) != 0) continue;
    const std::size_t value = line.find_first_not_of(": \t", line.find(':'));
    return value == std::string::npos ? "" : line.substr(value);
  }
  return "";
}

}  // namespace

std::vector<std::pair<std::string, std::string>> machine() {
  std::string targets;
  for (const auto* table : engine::kernels::usable_tables()) {
    if (!targets.empty()) targets += " ";
    targets += table->name;
  }
#if defined(__clang__)
  const std::string compiler = "clang " __clang_version__;
#else
  const std::string compiler = "g++ " __VERSION__;
#endif
  return {{"processor", line_of("/proc/cpuinfo", "model name")},
          {"hardware_threads", std::to_string(std::thread::hardware_concurrency())},
          {"compiler", compiler},
          {"target", value_or_give_up(engine::kernels::chosen_table())->name},
          {"usable_targets", targets},
          {"windsplat", WINDSPLAT_VERSION}};
}

std::string machine_line() {
  std::string line;
  for (const auto& [name, value] : machine()) {
    if (!line.empty()) line += "; ";
    line += name;
    line += ": ";
    line += value;
  }
  return line + "\n\n";
}

void add_context() {
  for (const auto& [name, value] : machine()) benchmark::AddCustomContext(name, value);
}

std::string take_option(int& argc, char** argv, const std::string& name) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    std::string value;
    if (argument == name) value = "set";
    if (argument.rfind(name + "=", 0) == 0) value = argument.substr(name.size() + 1);
    if (value.empty()) continue;
    std::rotate(argv + i, argv + i + 1, argv + argc);
    --argc;
    return value;
  }
  return "";
}

std::size_t process_bytes(const std::string& key) {
  constexpr std::size_t kibibyte = 1024;
  const std::string value = line_of("/proc/self/status", key);
  return value.empty() ? 0 : kibibyte * std::stoull(value);
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) give_up("cannot write '" + path + "'");
}

}  // namespace windsplat::bench
