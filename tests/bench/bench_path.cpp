// A dataset and a camera path -> times of its frames as JSON on stdout, and the first frame as a
// picture. The path is a file of views, one JSON document per line. compare.py runs it beside other
// renderers:
//
//   bench_path DATASET VIEWS.jsonl PICTURE.png [--threads=N]
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "protocol/codec.hpp"
#include "server/data/open/open.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/frame/frame.hpp"
#include "tests/bench/support.hpp"

namespace windsplat {
namespace {

using bench::value_or_give_up;

double cpu_ms() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ms = [](const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

std::vector<protocol::View> read_views(const std::string& path, const std::string& dataset) {
  std::ifstream file(path);
  std::vector<protocol::View> views;
  std::string line;
  while (std::getline(file, line)) {
    views.push_back(value_or_give_up(protocol::ViewDocument::parse(line)).view());
    views.back().dataset = dataset;
  }
  if (views.empty()) bench::give_up("no views in '" + path + "'");
  return views;
}

void draw(data::Dataset& dataset, const std::vector<protocol::View>& views, unsigned threads,
          const std::string& picture) {
  ThreadPool pool(threads);
  const CancelToken cancel;
  frame::Workspace workspace;  // kept between frames, as by a daemon
  frame::Encoding encoding;
  encoding.quality = 80;
  encoding.subsampling = image::Subsampling::s420;
  value_or_give_up(frame::produce(views.front(), dataset, encoding, pool, cancel, workspace));
  std::string frames;
  for (const protocol::View& view : views) {
    const double cpu = cpu_ms();
    const auto start = std::chrono::steady_clock::now();
    const auto frame =
        value_or_give_up(frame::produce(view, dataset, encoding, pool, cancel, workspace));
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
    char text[128];
    std::snprintf(text, sizeof text, R"(%s{"wall_ms":%.3f,"cpu_ms":%.3f,"render_ms":%.3f})",
                  frames.empty() ? "" : ",", wall.count(), cpu_ms() - cpu,
                  1e-3 * static_cast<double>(frame.render_us));
    frames += text;
  }
  const std::size_t peak = bench::process_bytes("VmHWM");
  encoding.format = frame::Format::png;
  const auto first =
      value_or_give_up(frame::produce(views.front(), dataset, encoding, pool, cancel, workspace));
  bench::write_file(picture, {first.bytes.begin(), first.bytes.end()});
  std::string names;
  for (const auto& [name, value] : bench::machine()) names += ",\"" + name + "\":\"" + value + "\"";
  std::printf("{\"frames\":[%s],\"peak_bytes\":%zu%s}\n", frames.c_str(), peak, names.c_str());
}

int run(int argc, char** argv) {
  const std::string threads = bench::take_option(argc, argv, "--threads");
  if (argc != 4) bench::give_up("bench_path DATASET VIEWS.jsonl PICTURE.png [--threads=N]");
  const std::string name = argv[1];
  auto source =
      name.find('.') == std::string::npos ? data::open_sample(name) : data::open_file(name);
  constexpr std::uint64_t bytes_max = std::uint64_t{4} << 30U;
  data::Dataset dataset(value_or_give_up(std::move(source)), "path", bytes_max);
  draw(dataset, read_views(argv[2], "path"),
       threads.empty() ? 0U : static_cast<unsigned>(std::stoul(threads)), argv[3]);
  return 0;
}

}  // namespace
}  // namespace windsplat

int main(int argc, char** argv) { return windsplat::run(argc, argv); }
