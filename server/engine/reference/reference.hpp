// Scene -> the picture that every method is measured against: the volume rendering integral itself,
// pixel by pixel, in double precision. Slow and plain; pure, and the same for any number of
// threads.
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
  double tolerance = 1e-10;  // absolute error of a pixel's premultiplied colour that is aimed at
};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<double> rgba;      // linear premultiplied, row 0 on top
  std::int64_t pieces = 0;       // that rays were cut into
  std::int64_t evaluations = 0;  // of the medium at a place of a ray
};

// The medium is rho(x) = sum_i rho_i K(|A_i^-1 (x - x_i)|) / C, A_i with a cell's edges as columns,
// and likewise its emission; the lines are sheets at their depth. No tolerance leaves anything out
// (min_magnitude says which lines there are), and Compositing does not matter. In perspective a
// splat whose centre is nearer than camera.near is not there, and rays begin at camera.near.
//
// progress (may be empty) is called with the rows done so far, from any worker. Errors: cancelled.
Result<Picture> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                       const Options& options = {}, const std::function<void(int)>& progress = {});

// Counts bytes of work in a limit while the answer is held.
using Reserve = std::function<Result<std::shared_ptr<const void>>(std::uint64_t bytes)>;

// Such a picture, drawn bit by bit: the same pixels, whatever is drawn first and by whom.
class Painting {
 public:
  // Lists the kernels, of which it keeps what it needs: the scene may go. `workers`: how many may
  // draw at a time. `reserve` is asked before there is anything, for as many kernels as there may
  // be, and before the lists of which tiles they cover, for those; empty: nothing is counted.
  // Errors: cancelled; those of `reserve`.
  static Result<std::unique_ptr<Painting>> begin(const scene::Scene& scene, unsigned workers,
                                                 const CancelToken& cancel,
                                                 const Options& options = {},
                                                 const Reserve& reserve = {});
  ~Painting();
  Painting(const Painting&) = delete;
  Painting& operator=(const Painting&) = delete;

  // Pixels [x0, x1) of a row into 4 values each, by a worker of which no other call has the number.
  // False where it was cancelled: not all of them.
  bool draw(int row, int x0, int x1, unsigned worker, const CancelToken& cancel, double* to);
  // So far.
  [[nodiscard]] std::int64_t pieces() const;
  [[nodiscard]] std::int64_t evaluations() const;

 private:
  struct State;
  explicit Painting(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

// K(r), r in cells: the 3-D kernel whose integral along a line at distance r from its middle is the
// splat's footprint g(r) (its inverse Abel transform). K >= 0, and 0 from r = 1.37 on.
double kernel_3d(double r);

}  // namespace windsplat::engine::reference
