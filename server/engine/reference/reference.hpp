// Scene -> reference picture, relative to which the errors of all methods are measured: the volume
// rendering integral per pixel in double precision. Independent of the number of threads.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine::reference {

struct Options {
  double tolerance = 1e-10;  // target absolute error of the premultiplied colour of a pixel
};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<double> rgba;      // linear premultiplied, row 0 on top
  std::int64_t pieces = 0;       // intervals of rays
  std::int64_t evaluations = 0;  // evaluations of the medium at points of rays
};

// The medium is rho(x) = sum_i rho_i K(|A_i^-1 (x - x_i)|) / C, where the columns of A_i are the
// edges of a cell, and likewise its emission; lines and the body are surfaces at their depth.
// Tolerances and Compositing are ignored, except that min_magnitude selects the lines. In
// perspective, rays begin at camera.near: of kernels that reach it, the part beyond counts,
// wherever their centres are.
//
// progress (may be empty) is called with the number of finished rows, from any thread. Errors:
// cancelled.
Result<Picture> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                       const Options& options = {}, const std::function<void(int)>& progress = {});

// Reserves bytes of a memory limit until the returned handle is released.
using Reserve = std::function<Result<std::shared_ptr<const void>>(std::uint64_t bytes)>;

// A reference picture rendered incrementally; its pixels do not depend on order or worker.
class Painting {
 public:
  // Lists the kernels; the scene need not outlive the call. `workers`: largest number of concurrent
  // draw calls. `reserve` is called before the kernels are listed, for an upper bound on their
  // size, and before they are listed by tile; if empty, memory is not limited.
  // Errors: cancelled; those of `reserve`.
  static Result<std::unique_ptr<Painting>> begin(const scene::Scene& scene, unsigned workers,
                                                 const CancelToken& cancel,
                                                 const Options& options = {},
                                                 const Reserve& reserve = {});
  ~Painting();
  Painting(const Painting&) = delete;
  Painting& operator=(const Painting&) = delete;

  // Renders pixels [x0, x1) of a row to 4 values each. Concurrent calls must use different worker
  // numbers. Returns false if cancelled; the pixels are then incomplete.
  bool draw(int row, int x0, int x1, unsigned worker, const CancelToken& cancel, double* to);
  // Counts so far.
  [[nodiscard]] std::int64_t pieces() const;
  [[nodiscard]] std::int64_t evaluations() const;

 private:
  struct State;
  explicit Painting(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

// K(r), r in cells: the 3-D kernel whose integral along a line at distance r from its centre is the
// footprint g(r) of the splat (inverse Abel transform of g). K >= 0, and 0 for r >= 1.37.
double kernel_3d(double r);

}  // namespace windsplat::engine::reference
