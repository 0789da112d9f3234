// Shared by the benchmarks: datasets and views of the workloads, the machine, and fatal errors.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::bench {

[[noreturn]] void give_up(const std::string& message);

template <class T>
T value_or_give_up(Result<T> result) {
  if (!result) give_up(result.error().message);
  return std::move(*result);
}

// A built-in sample at a size; {0, 0, 0} is its default.
struct Sample {
  const char* name;
  std::array<int, 3> dims{0, 0, 0};
};

inline constexpr Sample climate{"climate"};
inline constexpr Sample tornado_256{"tornado", {256, 256, 256}};
inline constexpr Sample tornado_512{"tornado", {512, 512, 512}};

// every_line: draws a line for every wind above a thousandth of the range, as in the figures of the
// paper, instead of the default of the view.
struct Workload {
  std::string name;
  Sample sample = climate;
  const char* preset = "default";
  int width = 640;
  int height = 480;
  bool every_line = true;
  protocol::MethodName method = protocol::MethodName::kernel;  // as moving frames are drawn
  protocol::Detail detail = protocol::Detail::full;  // every sample, whatever the size of the
                                                     // picture
  bool naive = true;   // also rendered by the naive renderer, for comparison
  bool heavy = false;  // takes seconds per frame by the naive renderer, or a gigabyte of data
};

// The first step, opened once and kept until another sample is requested.
data::Dataset& dataset_of(const Sample& sample);

// The completed view of the workload: the preset from azimuth 20, elevation 35 (degrees).
protocol::View view_of(const Workload& workload);

// The same view from another azimuth.
void turn(protocol::View& view, const Workload& workload, double azimuth);

scene::Scene scene_of(const Workload& workload);

// 1, 2, 4, ... and the number of hardware threads.
std::vector<unsigned> thread_counts();

// As in "context" of the JSON: name and value of processor, compiler, targets, version.
std::vector<std::pair<std::string, std::string>> machine();

// The same as a line above a table, Markdown.
std::string machine_line();

// Adds machine() to Google Benchmark's context.
void add_context();

// The value of `--name=value`, or "set" for `--name`; empty if absent. The argument is removed from
// argv.
std::string take_option(int& argc, char** argv, const std::string& name);

// Bytes from /proc/self/status, for example of "VmHWM"; 0 if not available.
std::size_t process_bytes(const std::string& key);

void write_file(const std::string& path, const std::string& text);

}  // namespace windsplat::bench
