// Writes small netCDF files through the C library, so that the reader is tested independently of
// the project's writer.
#pragma once

#include <gtest/gtest.h>
#include <netcdf.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace windsplat::data::test {

// A temporary folder for each test, removed at its end.
class Folder {
 public:
  Folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string(test->test_suite_name()) + "." + test->name();
    for (char& c : name) {
      c = c == '/' ? '-' : c;
    }
    path_ = std::filesystem::temp_directory_path() /
            ("windsplat-" + std::to_string(::getpid()) + "-" + name);
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] std::string operator/(const std::string& name) const {
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

class NetcdfMaker {
 public:
  // mode: NC_NETCDF4, NC_CLASSIC_MODEL, NC_64BIT_OFFSET, NC_64BIT_DATA or 0 for CDF-1.
  explicit NetcdfMaker(const std::string& path, int mode = NC_NETCDF4) {
    check(nc_create(path.c_str(), mode | NC_CLOBBER, &id_));
  }
  NetcdfMaker(const NetcdfMaker&) = delete;
  NetcdfMaker& operator=(const NetcdfMaker&) = delete;
  ~NetcdfMaker() { finish(); }

  int dimension(const std::string& name, std::size_t length) {
    int dimension = -1;
    check(nc_def_dim(id_, name.c_str(), length, &dimension));
    return dimension;
  }

  // values: in the order of the file; empty leaves the variable unwritten.
  int variable(const std::string& name, nc_type type, const std::vector<int>& dimensions,
               std::vector<double> values = {}) {
    int variable = -1;
    check(nc_def_var(id_, name.c_str(), type, static_cast<int>(dimensions.size()),
                     dimensions.data(), &variable));
    if (!values.empty()) {
      pending_.emplace_back(variable, std::move(values));
    }
    return variable;
  }

  // A dimension and its coordinate variable.
  int axis(const std::string& name, const std::vector<double>& values, const std::string& units,
           const std::string& standard_name = "") {
    const int dim = dimension(name, values.size());
    const int var = variable(name, NC_DOUBLE, {dim}, values);
    if (!units.empty()) {
      text(var, "units", units);
    }
    if (!standard_name.empty()) {
      text(var, "standard_name", standard_name);
    }
    return dim;
  }

  void text(int variable, const char* name, const std::string& value) {
    check(nc_put_att_text(id_, variable, name, value.size(), value.c_str()));
  }
  void number(int variable, const char* name, nc_type type, const std::vector<double>& values) {
    check(nc_put_att_double(id_, variable, name, type, values.size(), values.data()));
  }
  void deflate(int variable) { check(nc_def_var_deflate(id_, variable, 1, 1, 1)); }
  void chunk(int variable, const std::vector<std::size_t>& lengths) {
    check(nc_def_var_chunking(id_, variable, NC_CHUNKED, lengths.data()));
  }
  [[nodiscard]] int variable_id(const std::string& name) const {
    int variable = -1;
    check(nc_inq_varid(id_, name.c_str(), &variable));
    return variable;
  }
  [[nodiscard]] int id() const { return id_; }

  void finish() {
    if (id_ < 0) {
      return;
    }
    const int status = nc_enddef(id_);
    EXPECT_TRUE(status == NC_NOERR || status == NC_ENOTINDEFINE) << nc_strerror(status);
    for (const auto& [variable, values] : pending_) {
      put(variable, values);
    }
    check(nc_close(id_));
    id_ = -1;
  }

 private:
  static void check(int status) { EXPECT_EQ(status, NC_NOERR) << nc_strerror(status); }

  // An unlimited first dimension gets as many records as there are values.
  void put(int variable, const std::vector<double>& values) const {
    int rank = 0;
    std::vector<int> dims(NC_MAX_VAR_DIMS);
    check(nc_inq_var(id_, variable, nullptr, nullptr, &rank, dims.data(), nullptr));
    std::vector<std::size_t> start(static_cast<std::size_t>(rank) + 1, 0);
    std::vector<std::size_t> count(static_cast<std::size_t>(rank) + 1, 1);
    std::size_t rest = values.size();
    for (int d = rank - 1; d > 0; --d) {
      std::size_t length = 0;
      check(nc_inq_dimlen(id_, dims[static_cast<std::size_t>(d)], &length));
      count[static_cast<std::size_t>(d)] = length;
      rest /= length;
    }
    if (rank > 0) {
      count[0] = rest;
    }
    check(nc_put_vara_double(id_, variable, start.data(), count.data(), values.data()));
  }

  int id_ = -1;
  std::vector<std::pair<int, std::vector<double>>> pending_;
};

inline std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void write_bytes(const std::string& path, const std::string& bytes) {
  // Creates a new file: some file systems flush to disk when an existing one is overwritten.
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// n values 0, 1, 2, ...
inline std::vector<double> counting(std::size_t n, double first = 0) {
  std::vector<double> out(n);
  for (std::size_t i = 0; i < n; ++i) {
    out[i] = first + static_cast<double>(i);
  }
  return out;
}

}  // namespace windsplat::data::test
