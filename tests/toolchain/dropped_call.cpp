// Checks whether the compiler keeps a call whose only effect is to fill arrays: GCC bug 110702. The
// optimisation of induction variables may address samples.offset[l] from the base 0. Two later
// analyses (-fipa-modref, -fipa-pure-const) treat that as a null dereference and the function as
// one without effect, so its calls are removed. The program exits with 0 if the call is kept.
#include <cstdint>

namespace {

struct Samples {
  int count;
  std::int64_t offset[64];
  float x[64], y[64], z[64], depth[64];
};

struct Camera {
  double axis[3][3];
  double eye[3];
  double depth_origin;
};

double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

[[gnu::noinline]] void place(const Camera& camera, const float* positions, Samples& samples) {
  const int count = samples.count;
  for (int l = 0; l < count; ++l) {
    const float* position = positions + 3 * samples.offset[l];
    double at[3];
    for (int c = 0; c < 3; ++c) at[c] = static_cast<double>(position[c]) - camera.eye[c];
    const double z = dot(camera.axis[2], at);
    samples.x[l] = static_cast<float>(dot(camera.axis[0], at));
    samples.y[l] = static_cast<float>(dot(camera.axis[1], at));
    samples.z[l] = static_cast<float>(z);
    samples.depth[l] = static_cast<float>(z - camera.depth_origin);
  }
}

float first_x(const Camera& camera, const float* positions, Samples& samples) {
  place(camera, positions, samples);
  return samples.x[0];
}

}  // namespace

int main() {
  const float positions[3] = {7, 8, 9};
  const Camera camera = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}, 0};
  Samples samples = {};
  samples.count = 1;
  // Called through a pointer: main itself is optimised as code that runs once.
  float (*const volatile called)(const Camera&, const float*, Samples&) = first_x;
  return called(camera, positions, samples) == 7 ? 0 : 1;
}
