// Speed of reading the volumes of a dataset: with the bare library or bare reads, with the reader
// in this process, and with a loader process (which also transfers and validates them). Files are
// written and read once before, so that they are in the page cache; each read uses memory that is
// new to the process, as resident volumes do. Milliseconds per step of one scalar, and of a vector
// and a scalar (four components), the minimum of the rounds; ratios to the bare read; processor
// milliseconds of the bare read and of the reader in a loader with this process.
//
//   bench_load [--program=windsplat] [--dims=320x160x19] [--steps=8] [--rounds=7] [--only=raw]
//              [--markdown]
//
// Run by `taskset -c 0` for the times on one processor.
#include <fcntl.h>
#include <hdf5.h>
#include <malloc.h>
#include <netcdf.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "files/zarr_store.hpp"
#include "server/data/formats/netcdf/writer.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "server/data/samples/samples.hpp"
#include "support.hpp"
#include "text_table.hpp"

namespace {

using namespace windsplat;
using Clock = std::chrono::steady_clock;

struct Options {
  std::string program = "windsplat";
  std::array<int, 3> dims{320, 160, 19};
  int steps = 8;
  int rounds = 7;
  std::string only;  // one kind of file, by name
  bool markdown = false;
};

Options options_of(int argc, char** argv) {
  Options out;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const auto value = [&](const char* name) {
      const std::string start = std::string("--") + name + "=";
      return word.starts_with(start) ? word.substr(start.size()) : std::string();
    };
    if (word == "--markdown") out.markdown = true;
    if (auto v = value("program"); !v.empty()) out.program = v;
    if (auto v = value("only"); !v.empty()) out.only = v;
    if (auto v = value("steps"); !v.empty()) out.steps = std::stoi(v);
    if (auto v = value("rounds"); !v.empty()) out.rounds = std::stoi(v);
    if (auto v = value("dims"); !v.empty()) {
      std::sscanf(v.c_str(), "%dx%dx%d", &out.dims[0], &out.dims[1], &out.dims[2]);
    }
  }
  return out;
}

void check(int status) {
  if (status != NC_NOERR) bench::give_up(nc_strerror(status));
}

// The variables u, v, w and cloud as one netCDF file, chunked by step, optionally deflated.
void write_netcdf(const std::string& path, data::Source& source, int format, int deflate) {
  const auto dims = source.info().grid.dims();
  const std::size_t steps = source.info().steps.size();
  int ncid = 0;
  std::array<int, 4> ids{};
  check(nc_create(path.c_str(), NC_CLOBBER | format, &ncid));
  check(nc_def_dim(ncid, "time", steps, &ids[0]));
  const std::array<const char*, 3> names{"z", "y", "x"};
  for (std::size_t a = 0; a < 3; ++a) {
    check(nc_def_dim(ncid, names.at(a), static_cast<std::size_t>(dims.at(2 - a)), &ids.at(a + 1)));
  }
  std::vector<int> variables;
  for (const char* name : {"u", "v", "w", "cloud"}) {
    variables.emplace_back();
    check(nc_def_var(ncid, name, NC_FLOAT, 4, ids.data(), &variables.back()));
    if (deflate > 0) check(nc_def_var_deflate(ncid, variables.back(), 1, 1, deflate));
  }
  check(nc_enddef(ncid));
  for (std::size_t t = 0; t < steps; ++t) {
    const auto wind = bench::value_or_give_up(source.read(0, t));
    const auto cloud = bench::value_or_give_up(source.read(1, t));
    const std::array<std::size_t, 4> start{t, 0, 0, 0};
    const std::array<std::size_t, 4> count{1, static_cast<std::size_t>(dims[2]),
                                           static_cast<std::size_t>(dims[1]),
                                           static_cast<std::size_t>(dims[0])};
    for (int c = 0; c < 4; ++c) {
      const float* values = c < 3 ? wind.component(c) : cloud.component(0);
      check(nc_put_vara_float(ncid, variables.at(static_cast<std::size_t>(c)), start.data(),
                              count.data(), values));
    }
  }
  check(nc_close(ncid));
}

void write_raw(const std::string& folder, data::Source& source) {
  const auto dims = source.info().grid.dims();
  std::ofstream raw(folder + "/raw.bin", std::ios::binary);
  for (std::size_t t = 0; t < source.info().steps.size(); ++t) {
    for (const std::size_t field : {0U, 1U}) {
      const auto volume = bench::value_or_give_up(source.read(field, t));
      raw.write(reinterpret_cast<const char*>(volume.component(0)),
                static_cast<std::streamsize>(volume.bytes()));
    }
  }
  std::ofstream(folder + "/raw.json")
      << R"({"windsplat": "raw", "file": "raw.bin", "type": "float32", "endian": "little", )"
      << R"("dims": {"x": )" << dims[0] << R"(, "y": )" << dims[1] << R"(, "z": )" << dims[2]
      << R"(}, "steps": {"count": )" << source.info().steps.size()
      << R"(}, "fields": [{"name": "wind", "components": ["u", "v", "w"], "layout": "planar"},
               {"name": "cloud"}]})";
}

void require(bool fine, const char* what) {
  if (!fine) bench::give_up(what);
}

// The datasets /VTKHDF/PointData/wind (step, z, y, x, component) and cloud (step, z, y, x).
constexpr std::array<const char*, 2> hdf_paths{"/VTKHDF/PointData/wind", "/VTKHDF/PointData/cloud"};

// An image of VTKHDF with steps.
void write_vtkhdf(const std::string& path, data::Source& source) {
  const auto dims = source.info().grid.dims();
  const hsize_t steps = source.info().steps.size();
  const std::size_t samples = source.info().grid.samples();
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(links, 1);
  const auto make = [&](const char* name, const std::vector<hsize_t>& lengths, hid_t type) {
    const hid_t space = H5Screate_simple(static_cast<int>(lengths.size()), lengths.data(), nullptr);
    const hid_t made = H5Dcreate2(file, name, type, space, links, H5P_DEFAULT, H5P_DEFAULT);
    H5Sclose(space);
    require(made >= 0, name);
    return made;
  };
  const auto attribute = [&](const char* group, const char* name, const std::vector<double>& values,
                             hid_t type) {
    const hsize_t count = values.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr);
    const hid_t made =
        H5Acreate_by_name(file, group, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    require(H5Awrite(made, H5T_NATIVE_DOUBLE, values.data()) >= 0, name);
    H5Aclose(made);
    H5Sclose(space);
  };
  std::array<hsize_t, 5> start{};
  std::array<hsize_t, 5> count{1, static_cast<hsize_t>(dims[2]), static_cast<hsize_t>(dims[1]),
                               static_cast<hsize_t>(dims[0]), 3};
  for (const std::size_t field : {0U, 1U}) {
    std::vector<hsize_t> lengths(count.begin(), count.end() - static_cast<std::ptrdiff_t>(field));
    lengths[0] = steps;
    const hid_t made = make(hdf_paths.at(field), lengths, H5T_IEEE_F32LE);
    const std::size_t components = field == 0 ? 3 : 1;
    std::vector<float> values(samples * components);
    for (std::size_t t = 0; t < steps; ++t) {
      const auto volume = bench::value_or_give_up(source.read(field, t));
      for (std::size_t n = 0; n < values.size(); ++n) {
        values[n] = volume.component(static_cast<int>(n % components))[n / components];
      }
      start[0] = t;
      const hid_t space = H5Dget_space(made);
      H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
      const hid_t memory =
          H5Screate_simple(static_cast<int>(lengths.size()), count.data(), nullptr);
      require(H5Dwrite(made, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT, values.data()) >= 0,
              "a field cannot be written");
      H5Sclose(memory);
      H5Sclose(space);
    }
    H5Dclose(made);
  }
  const std::vector<double> times = [&] {
    std::vector<double> out(steps);
    for (std::size_t t = 0; t < steps; ++t) out[t] = static_cast<double>(t);
    return out;
  }();
  const hid_t values = make("/VTKHDF/Steps/Values", {steps}, H5T_IEEE_F64LE);
  H5Dwrite(values, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, times.data());
  H5Dclose(values);
  attribute("/VTKHDF/Steps", "NSteps", {static_cast<double>(steps)}, H5T_STD_I64LE);
  attribute("/VTKHDF", "Version", {2, 0}, H5T_STD_I64LE);
  attribute("/VTKHDF", "WholeExtent", {0, dims[0] - 1.0, 0, dims[1] - 1.0, 0, dims[2] - 1.0},
            H5T_STD_I64LE);
  attribute("/VTKHDF", "Origin", {0, 0, 0}, H5T_IEEE_F64LE);
  attribute("/VTKHDF", "Spacing", {1, 1, 1}, H5T_IEEE_F64LE);
  attribute("/VTKHDF", "Direction", {1, 0, 0, 0, 1, 0, 0, 0, 1}, H5T_IEEE_F64LE);
  const std::string type = "ImageData";
  const hid_t text = H5Tcopy(H5T_C_S1);
  H5Tset_size(text, type.size());
  const hid_t single = H5Screate(H5S_SCALAR);
  const hid_t kind = H5Acreate_by_name(file, "/VTKHDF", "Type", text, single, H5P_DEFAULT,
                                       H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(kind, text, type.c_str());
  H5Aclose(kind);
  H5Sclose(single);
  H5Tclose(text);
  H5Pclose(links);
  H5Fclose(file);
}

// What a round reads of each step: "cloud", or "wind" and "cloud".
using Fields = std::vector<std::string>;

bool has_wind(const Fields& fields) { return fields.size() > 1; }

// The variables of netCDF and Zarr files.
std::vector<std::string> variables_of(const Fields& fields) {
  if (has_wind(fields)) return {"u", "v", "w", "cloud"};
  return {"cloud"};
}

// Seconds of processor time of this process, and of another with its id.
double processor_seconds(pid_t other) {
  rusage own{};
  ::getrusage(RUSAGE_SELF, &own);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  double out = seconds(own.ru_utime) + seconds(own.ru_stime);
  clockid_t clock{};
  timespec used{};
  if (other > 0 && ::clock_getcpuclockid(other, &clock) == 0 &&
      ::clock_gettime(clock, &used) == 0) {
    out += static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  }
  return out;
}

struct Least {
  double seconds = 1e30;
  double processor_seconds = 1e30;
};

// The minima of the rounds after an untimed one. `loader`: the id of a process that takes part.
Least least(
    int rounds, const std::function<void()>& work,
    const std::function<pid_t()>& loader = [] { return pid_t{-1}; }) {
  work();
  Least out;
  for (int r = 0; r < rounds; ++r) {
    const double used = processor_seconds(loader());
    const auto start = Clock::now();
    work();
    out.seconds =
        std::min(out.seconds, std::chrono::duration<double>(Clock::now() - start).count());
    out.processor_seconds = std::min(out.processor_seconds, processor_seconds(loader()) - used);
  }
  return out;
}

// Volumes are kept for a round, as in a program that uses them.
using Kept = std::vector<std::unique_ptr<float[]>>;

float* take(Kept& kept, std::size_t floats) {
  kept.emplace_back(new float[floats]);
  return kept.back().get();
}

void read_bare_netcdf(const std::string& path, std::size_t steps, std::size_t samples,
                      const Fields& fields) {
  Kept kept;
  int ncid = 0;
  check(nc_open(path.c_str(), NC_NOWRITE, &ncid));
  std::array<int, 4> dims{};
  std::array<std::size_t, 4> count{1};
  for (std::size_t t = 0; t < steps; ++t) {
    for (const std::string& name : variables_of(fields)) {
      int variable = 0;
      check(nc_inq_varid(ncid, name.c_str(), &variable));
      check(nc_inq_vardimid(ncid, variable, dims.data()));
      for (std::size_t d = 1; d < 4; ++d) check(nc_inq_dimlen(ncid, dims.at(d), &count.at(d)));
      const std::array<std::size_t, 4> start{t, 0, 0, 0};
      check(nc_get_vara_float(ncid, variable, start.data(), count.data(), take(kept, samples)));
    }
  }
  check(nc_close(ncid));
}

void read_bare(const std::string& path, std::size_t steps, std::size_t samples,
               const Fields& fields) {
  Kept kept;
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const auto bytes = static_cast<ssize_t>(samples * sizeof(float));
  for (std::size_t i = 0; i < 4 * steps; ++i) {
    if (i % 4 < 3 && !has_wind(fields)) continue;
    const auto at = static_cast<off_t>(i) * bytes;
    if (::pread(file, take(kept, samples), static_cast<std::size_t>(bytes), at) != bytes) {
      bench::give_up("a file is shorter than when it was written");
    }
  }
  ::close(file);
}

void read_bare_hdf5(const std::string& path, std::size_t steps, std::size_t samples,
                    const Fields& fields) {
  Kept kept;
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  for (std::size_t t = 0; t < steps; ++t) {
    for (const std::size_t field : {0U, 1U}) {
      if (field == 0 && !has_wind(fields)) continue;
      const hid_t dataset = H5Dopen2(file, hdf_paths.at(field), H5P_DEFAULT);
      const hid_t space = H5Dget_space(dataset);
      std::array<hsize_t, 5> start{t};
      std::array<hsize_t, 5> count{};
      const int rank = H5Sget_simple_extent_dims(space, count.data(), nullptr);
      count[0] = 1;
      H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr);
      const hid_t memory = H5Screate_simple(rank, count.data(), nullptr);
      require(H5Dread(dataset, H5T_NATIVE_FLOAT, memory, space, H5P_DEFAULT,
                      take(kept, samples * (field == 0 ? 3 : 1))) >= 0,
              "a field cannot be read");
      H5Sclose(memory);
      H5Sclose(space);
      H5Dclose(dataset);
    }
  }
  H5Fclose(file);
}

void read_all(data::Source& source, const Fields& fields) {
  std::vector<data::Volume> kept;
  for (std::size_t t = 0; t < source.info().steps.size(); ++t) {
    for (const std::string& name : fields) {
      const data::FieldInfo* field = source.info().find(name);
      if (field == nullptr) bench::give_up("a field is missing");
      const auto index = static_cast<std::size_t>(field - source.info().fields.data());
      kept.push_back(bench::value_or_give_up(source.read(index, t)));
    }
  }
}

using Bare = std::function<void(const Fields&)>;

// Rows of one kind of file.
void measure(bench::Table& table, const std::string& name, const std::string& path,
             const Options& options, const Bare& bare) {
  const std::array<Fields, 2> rows{Fields{"cloud"}, Fields{"wind", "cloud"}};
  std::vector<Least> plain;
  // Called first: HDF5 would share unpacked chunks of an earlier opening of the file.
  for (const Fields& fields : rows) {
    plain.push_back(least(options.rounds, [&] { bare(fields); }));
  }
  const auto here = bench::value_or_give_up(data::open_file(path));
  const auto apart =
      bench::value_or_give_up(data::loader::open(bench::value_or_give_up(data::locate(path))));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Fields& fields = rows.at(i);
    const Least ours = least(options.rounds, [&] { read_all(*here, fields); });
    const Least loader = least(
        options.rounds, [&] { read_all(*apart, fields); }, [&] { return apart->process(); });
    const double each = 1000.0 / options.steps;
    table.push_back({name, has_wind(fields) ? "4" : "1",
                     bench::number("%.2f", each * plain[i].seconds),
                     bench::number("%.2f", each * ours.seconds),
                     bench::number("%.2f", ours.seconds / plain[i].seconds),
                     bench::number("%.2f", each * loader.seconds),
                     bench::number("%.2f", loader.seconds / plain[i].seconds),
                     bench::number("%.2f", each * plain[i].processor_seconds),
                     bench::number("%.2f", each * loader.processor_seconds)});
  }
}

}  // namespace

int main(int argc, char** argv) {
  ::mallopt(M_MMAP_THRESHOLD, 1 << 20);  // and is kept: memory is not released and reallocated
  const Options options = options_of(argc, argv);
  data::loader::set_program(options.program);
  const std::string folder =
      std::filesystem::temp_directory_path() / ("windsplat-load-" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  const auto source =
      bench::value_or_give_up(data::open_sample("climate", options.dims, options.steps));
  const std::size_t samples = source->info().grid.samples();
  const auto steps = static_cast<std::size_t>(options.steps);

  bench::Table table{{"file", "components", "bare ms", "reader ms", "ratio", "loader ms", "ratio",
                      "bare cpu", "loader cpu"}};
  const auto is_wanted = [&](const std::string& name) {
    return options.only.empty() || options.only == name;
  };
  struct Kind {
    const char* name;
    int format;
    int deflate;
  };
  for (const Kind kind :
       {Kind{"netCDF-4", NC_NETCDF4, 0}, Kind{"netCDF-4, deflated", NC_NETCDF4, 1},
        Kind{"netCDF CDF-5", NC_64BIT_DATA, 0}}) {
    if (!is_wanted(kind.name)) continue;
    const std::string path = folder + "/file.nc";
    write_netcdf(path, *source, kind.format, kind.deflate);
    measure(table, kind.name, path, options,
            [&](const Fields& fields) { read_bare_netcdf(path, steps, samples, fields); });
  }
  for (const bool by_blosc : {false, true}) {
    const std::string kind = by_blosc ? "Zarr, blosc (lz4)" : "Zarr, zstd";
    if (!is_wanted(kind)) continue;
    const std::string path = folder + "/store.zarr";
    bench::write_zarr(path, *source, by_blosc);
    measure(table, kind, path, options, [&](const Fields& fields) {
      Kept kept;
      for (std::size_t t = 0; t < steps; ++t) {
        for (const std::string& name : variables_of(fields)) {
          bench::read_zarr(path + '/' + name, options.dims, t, by_blosc, take(kept, samples));
        }
      }
    });
  }
  if (is_wanted("VTKHDF")) {
    const std::string path = folder + "/file.vtkhdf";
    write_vtkhdf(path, *source);
    measure(table, "VTKHDF", path, options,
            [&](const Fields& fields) { read_bare_hdf5(path, steps, samples, fields); });
  }
  if (is_wanted("raw")) {
    write_raw(folder, *source);
    measure(table, "raw", folder + "/raw.json", options,
            [&](const Fields& fields) { read_bare(folder + "/raw.bin", steps, samples, fields); });
  }
  std::filesystem::remove_all(folder);
  std::printf("%zu samples, 4 components, %d steps: %.1f MB per step\n\n%s", samples, options.steps,
              16e-6 * static_cast<double>(samples),
              (options.markdown ? bench::markdown(table) : bench::plain(table, 1)).c_str());
  return 0;
}
