// windsplat as a library: a volume and a view -> a picture. Errors are exceptions of type Problem;
// std::bad_alloc and std::system_error come from memory and threads that run out. The version is
// 0.x: a program built with one minor version needs that of the library (SOVERSION 0.1).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#define WINDSPLAT_API __attribute__((visibility("default")))

namespace windsplat {

// What was refused, and why: one sentence that names the place and the limit.
class WINDSPLAT_API Problem : public std::runtime_error {
 public:
  enum class Kind {
    invalid,        // an argument or a key of the view
    not_found,      // a file, a sample, a field
    bad_data,       // a file that is not understood
    too_large,      // more pixels or samples than the limit
    out_of_memory,  // the memory limit of a volume
    internal,       // a fault of the library or the system
  };
  Problem(Kind kind, const std::string& message);
  ~Problem() override;
  [[nodiscard]] Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

enum class AxisKind { cartesian, longitude, latitude, height, depth, pressure };

// One axis of a rectilinear grid, from west, south and bottom on: coordinates increase strictly,
// those of depth and pressure decrease.
struct Axis {
  std::string name;
  std::vector<double> coordinates;  // one for each sample, in `units`
  std::string units = "m";          // longitudes and latitudes: degrees; pressure: hPa or Pa
  AxisKind kind = AxisKind::cartesian;
};

// Values of one quantity. Each component has (steps, z, y, x) values, x fastest; NaN: no value.
struct Field {
  std::string name;
  std::vector<std::vector<float>> components;  // one: a scalar; two (x, y) or three: a vector
  std::string units;
  std::string standard_name = {};  // as in CF, which derived fields are found by; may be empty
};

inline constexpr std::uint64_t memory_default = std::uint64_t{8} << 30;

// A dataset: fields on a grid, by step. A handle: copies refer to the same data. Thread-safe.
// `memory`: bytes for the fields and steps that are held in memory, those used last.
class WINDSPLAT_API Volume {
 public:
  // A built-in sample: "tornado", "climate", "efield", or with a size, "tornado:128".
  static Volume sample(const std::string& name, std::uint64_t memory = memory_default);

  // Fields in memory, at least one, on a grid of three axes (x, y, z). `times`: that of each step,
  // in seconds.
  static Volume arrays(std::array<Axis, 3> axes, std::vector<Field> fields,
                       const std::vector<double>& times = {0},
                       std::uint64_t memory = memory_default);

  // A file, or a pattern of files, in any format that the program reads. A separate, confined
  // process reads it: the program windsplat of the same version (set_program()).
  static Volume file(const std::string& path, std::uint64_t memory = memory_default);

  Volume(const Volume&);
  Volume(Volume&&) noexcept;
  Volume& operator=(const Volume&);
  Volume& operator=(Volume&&) noexcept;
  ~Volume();

  [[nodiscard]] std::array<int, 3> size() const;  // samples along x, y, z
  [[nodiscard]] std::size_t steps() const;
  [[nodiscard]] std::vector<std::string> fields() const;  // their names, also of derived ones

 private:
  friend class Renderer;
  struct State;
  explicit Volume(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

// The program that reads files. By default windsplat in the folder bin of the prefix that this
// library is installed in. Call it before the first Volume::file().
WINDSPLAT_API void set_program(const std::string& path);

// What a picture shows, and how: the view of the daemon and the command line. Keys that are not
// set have defaults that follow from the volume.
class WINDSPLAT_API View {
 public:
  View();
  // The JSON text of a view, with any of its keys. A dataset that it names is disregarded.
  explicit View(const std::string& json);

  View(const View&);
  View(View&&) noexcept;
  View& operator=(const View&);
  View& operator=(View&&) noexcept;
  ~View();

  // Changes one key: set("/camera/fovY", "50"), set("/vector/field", "wind"). The value is JSON, or
  // a string if it is none.
  View& set(const std::string& pointer, const std::string& value);
  View& size(int width, int height);       // pixels; default: 1280 x 720
  View& step(int step);                    // from 0
  [[nodiscard]] std::string json() const;  // the keys that were set

 private:
  friend class Renderer;
  std::string json_;
};

// Pixels, row 0 on top.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  // 4 for each pixel: sRGB on the view's background; alpha is 255
  std::string empty;  // why the picture shows nothing of the data; empty if it shows some
};

struct LinearPicture {
  int width = 0;
  int height = 0;
  std::vector<float> rgba;  // 4 for each pixel: linear, premultiplied, without background, text and
                            // axes
  std::string empty;
};

// Draws pictures on the processors of this machine. Used by one thread at a time.
class WINDSPLAT_API Renderer {
 public:
  explicit Renderer(unsigned threads = 0);  // including the caller's; 0: one for each processor
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  Picture render(const Volume& volume, const View& view);
  LinearPicture render_linear(const Volume& volume, const View& view);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat
