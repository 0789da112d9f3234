// Creates files with the HDF5 library itself.
#pragma once

#include <gtest/gtest.h>
#include <hdf5.h>
#include <zlib.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace windsplat::data::test {

using Lengths = std::vector<hsize_t>;

// A file written by HDF5 itself; datasets are float32.
class Hdf5Maker {
 public:
  explicit Hdf5Maker(const std::string& path)
      : id_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    EXPECT_GE(id_, 0);
  }
  ~Hdf5Maker() { EXPECT_GE(H5Fclose(id_), 0); }
  Hdf5Maker(const Hdf5Maker&) = delete;
  Hdf5Maker& operator=(const Hdf5Maker&) = delete;
  [[nodiscard]] hid_t id() const { return id_; }

  using Plan = std::function<void(hid_t)>;
  // Calls `use` with the open dataset.
  void set(const std::string& name, const Lengths& dims, const Plan& plan, const Plan& use) const {
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    const hid_t how = H5Pcreate(H5P_DATASET_CREATE);
    plan(how);
    const hid_t set =
        H5Dcreate2(id_, name.c_str(), H5T_IEEE_F32LE, space, H5P_DEFAULT, how, H5P_DEFAULT);
    EXPECT_GE(set, 0) << name;
    use(set);
    H5Dclose(set);
    H5Pclose(how);
    H5Sclose(space);
  }
  // 4 x 8 x 8 ones.
  void ones(const std::string& name) const {
    set(
        name, {4, 8, 8}, [](hid_t) {},
        [](hid_t set) {
          const std::vector<float> values(256, 1);
          EXPECT_GE(H5Dwrite(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
                    0);
        });
  }

 private:
  hid_t id_;
};

inline std::vector<unsigned char> deflated_zeros(std::size_t count) {
  const std::vector<unsigned char> zeros(std::size_t{1} << 20, 0);
  std::vector<unsigned char> out(count / 900 + 4096);
  z_stream stream{};
  EXPECT_EQ(deflateInit(&stream, 9), Z_OK);
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  for (std::size_t done = 0; done < count;) {
    const std::size_t size = std::min(zeros.size(), count - done);
    stream.next_in = const_cast<unsigned char*>(zeros.data());
    stream.avail_in = static_cast<uInt>(size);
    EXPECT_EQ(deflate(&stream, Z_NO_FLUSH), Z_OK);
    done += size;
  }
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

// Chunks of zeros, `written` of them along the first dimension.
inline void deflated_set(const Hdf5Maker& file, const std::string& name, const Lengths& dims,
                         const Lengths& chunk, hsize_t written) {
  std::size_t bytes = sizeof(float);
  for (const hsize_t length : chunk) bytes *= length;
  const auto stored = deflated_zeros(bytes);
  file.set(
      name, dims,
      [&](hid_t plan) {
        H5Pset_chunk(plan, static_cast<int>(chunk.size()), chunk.data());
        H5Pset_shuffle(plan);  // leaves the zeros unchanged, but takes memory
        H5Pset_deflate(plan, 9);
      },
      [&](hid_t set) {
        Lengths at(chunk.size(), 0);
        for (hsize_t n = 0; n < written; ++n, at[0] += chunk[0]) {
          EXPECT_GE(H5Dwrite_chunk(set, H5P_DEFAULT, 0, at.data(), stored.size(), stored.data()),
                    0);
        }
      });
}

}  // namespace windsplat::data::test
