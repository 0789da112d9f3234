// Uses the installed library as a program of its own would; library_test.py compares its output.
// Usage: use FILE.nc [PROGRAM]      PROGRAM: reads files
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <string>
#include <windsplat/windsplat.hpp>

namespace {

using windsplat::Problem;

void need(bool holds, const std::string& what) {
  if (holds) return;
  std::cerr << "use: " << what << '\n';
  std::exit(1);
}

// The call is refused in this way.
void refused(const std::function<void()>& call, Problem::Kind kind, const std::string& text) {
  try {
    call();
  } catch (const Problem& problem) {
    need(problem.kind() == kind && std::string(problem.what()).find(text) != std::string::npos,
         std::string("refused, but as: ") + problem.what());
    return;
  }
  need(false, "not refused: " + text);
}

windsplat::Axis axis(const char* name, double first, double step, int count) {
  windsplat::Axis made{name, {}, "m"};
  for (int i = 0; i < count; ++i) made.coordinates.push_back(first + step * i);
  return made;
}

std::array<windsplat::Axis, 3> box() {
  return {axis("x", 0, 1, 4), axis("y", 0, 1, 3), axis("z", 0, 1, 2)};
}

windsplat::Field scalar(std::size_t values) {
  windsplat::Field made{"heat", {std::vector<float>(values)}, "K"};
  for (std::size_t i = 0; i < values; ++i) made.components[0][i] = static_cast<float>(i);
  return made;
}

void faulty_arrays_are_refused() {
  using windsplat::Volume;
  auto falling = box();
  falling[1] = axis("y", 0, -1, 3);
  refused([&] { Volume::arrays(falling, {scalar(24)}); }, Problem::Kind::invalid, "axis y");
  auto repeated = box();
  repeated[0].coordinates[2] = repeated[0].coordinates[1];
  refused([&] { Volume::arrays(repeated, {scalar(24)}); }, Problem::Kind::invalid, "monotonic");
  refused([&] { Volume::arrays(box(), {scalar(23)}); }, Problem::Kind::invalid, "23 values");
  refused([&] { Volume::arrays(box(), {scalar(24)}, {0, 60}); }, Problem::Kind::invalid, "not 48");
  refused([&] { Volume::arrays(box(), {}); }, Problem::Kind::invalid, "at least one field");
  refused([&] { Volume::arrays(box(), {scalar(24), scalar(24)}); }, Problem::Kind::invalid, "two");
  refused([&] { Volume::sample("storm"); }, Problem::Kind::not_found, "storm");
}

void faulty_views_are_refused() {
  refused([] { windsplat::View("{\"imag\": 1}"); }, Problem::Kind::invalid, "/imag");
  refused([] { windsplat::View().set("/camera/fovY", "400"); }, Problem::Kind::invalid, "/camera");
  refused([] { windsplat::View().size(0, 10); }, Problem::Kind::invalid, "/image/width");
  const auto volume = windsplat::Volume::arrays(box(), {scalar(24)});
  refused([&] { windsplat::Renderer(1).render(volume, windsplat::View().step(1)); },
          Problem::Kind::invalid, "/step");
}

void steps_and_masks_of_arrays_are_kept() {
  auto field = scalar(48);
  field.components[0][0] = std::numeric_limits<float>::quiet_NaN();
  const auto volume = windsplat::Volume::arrays(box(), {field}, {0, 60});
  need(volume.steps() == 2 && volume.size() == std::array<int, 3>{4, 3, 2}, "size of the arrays");
  need(volume.fields().front() == "heat", "name of the field");
  windsplat::View view;
  view.size(64, 48);
  windsplat::Renderer renderer(2);
  const auto first = renderer.render(volume, view);
  const auto second = renderer.render(volume, view.step(1));
  need(first.rgba.size() == std::size_t{4} * 64 * 48 && first.rgba[3] == 255, "pixels of 4 bytes");
  need(first.empty.empty() && first.rgba != second.rgba, "each step has its picture");
  need(renderer.render(volume, view).rgba == second.rgba, "equal views give equal pictures");
}

// The numbers of a picture, for the comparison with those of the program.
void write(const windsplat::LinearPicture& picture, const char* name) {
  std::ofstream out(name, std::ios::binary);
  out.write(reinterpret_cast<const char*>(picture.rgba.data()),
            static_cast<std::streamsize>(picture.rgba.size() * sizeof(float)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  if (argc > 2) windsplat::set_program(argv[2]);
  faulty_arrays_are_refused();
  faulty_views_are_refused();
  steps_and_masks_of_arrays_are_kept();
  windsplat::View view("{\"step\": 2}");
  view.size(96, 64);
  windsplat::Renderer renderer(2);
  write(renderer.render_linear(windsplat::Volume::sample("tornado:24"), view), "sample.bin");
  const char* const missing = argc > 2 ? argv[2] : "absent.nc";
  refused([] { windsplat::Volume::file("absent.nc"); }, Problem::Kind::not_found, missing);
  try {
    write(renderer.render_linear(windsplat::Volume::file(argv[1]), view), "file.bin");
  } catch (const Problem& problem) {
    std::cout << problem.what() << '\n';
  }
}
