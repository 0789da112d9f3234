// Groups of a VTKHDF file (VTK File Formats, "VTKHDF"; versions 1 and 2) -> snapshots.
#include <algorithm>
#include <cmath>
#include <utility>

#include "server/data/cf/grid/grid.hpp"
#include "server/data/formats/vtk/hdf_file.hpp"

namespace windsplat::data::vtk {

namespace {

using Counts64 = std::vector<std::uint64_t>;

constexpr const char* root_group = "/VTKHDF";
constexpr std::size_t hdf_steps_max = 20'000;
constexpr std::size_t hdf_parts_max = 65'536;

// A whole number from a file, within what sizes may be.
std::optional<std::uint64_t> whole_number(double value) {
  if (!(value >= 0 && value < 9e15) || value != std::floor(value)) return {};
  return static_cast<std::uint64_t>(value);
}

// One grid: the root group, or that of a block.
class HdfGrid {
 public:
  HdfGrid(HdfFile& file, std::string group, std::size_t step)
      : file_(file), group_(std::move(group)), step_(step) {}

  Result<Snapshot> read(const std::string& type) {
    has_steps_ = file_.numbers(group_ + "/Steps", "NSteps", 1).has_value();
    auto done = type == "ImageData" ? read_image() : read_mesh_parts();
    if (!done) return done.error();
    if (auto fine = check_snapshot(file_.input(), out_, Part::of_step); !fine) return fine.error();
    for (Piece& piece : out_.pieces) {
      piece.kind = out_.kind;
      piece.place = out_.place;
    }
    return std::move(out_);
  }

 private:
  [[nodiscard]] Error fault(const std::string& what) const {
    return file_.input()->fault("is malformed: " + in_quotes(group_) + " " + what);
  }

  // The value of this step in a dataset of the group Steps; nullopt if there is none.
  Result<std::optional<std::uint64_t>> of_step(const std::string& name) {
    const std::string path = group_ + "/Steps/" + name;
    if (!has_steps_ || file_.lengths(path).empty()) return std::optional<std::uint64_t>();
    const auto values = file_.values(path, step_, 1);
    if (!values) return values.error();
    const auto number = whole_number(values->front());
    if (!number) return fault("has no valid number in " + in_quotes("Steps/" + name));
    return number;
  }

  // data: PointData or CellData.
  [[nodiscard]] std::string path_of(const std::string& data, const std::string& array) const {
    std::string path = group_ + '/' + data;
    path += '/';
    path += array;
    return path;
  }

  // Where the values of this step begin in an array, if the file says so.
  Result<std::optional<std::uint64_t>> offset_of(std::string data, const std::string& array) {
    data += "Offsets/";
    data += array;
    return of_step(data);
  }

  Result<void> read_image() {
    out_.kind = Kind::image;
    out_.format = "VTKHDF image data";
    const auto extent = file_.numbers(group_, "WholeExtent", 6);
    if (!extent) return fault("has no WholeExtent of six whole numbers");
    for (std::size_t a = 0; a < 3; ++a) {
      const double first = (*extent)[2 * a];
      const double last = (*extent)[2 * a + 1];
      if (!(std::abs(first) < 2147483648.0 && std::abs(last) < 2147483648.0)) {
        return fault("has a WholeExtent beyond 2^31");
      }
      out_.whole.first[a] = std::llround(first);
      out_.whole.last[a] = std::llround(last);
    }
    const auto list = [&](const char* name, auto& to) -> Result<void> {
      if (!file_.has_attribute(group_, name)) return {};
      const auto found = file_.numbers(group_, name, to.size());
      if (!found) return fault("has no " + std::to_string(to.size()) + " numbers in its " + name);
      std::copy(found->begin(), found->end(), to.begin());
      return {};
    };
    if (auto done = list("Origin", out_.place.origin); !done) return done;
    if (auto done = list("Spacing", out_.place.spacing); !done) return done;
    if (auto done = list("Direction", out_.place.direction); !done) return done;
    Piece piece;
    piece.extent = out_.whole;
    const auto points = out_.whole.points();
    for (const std::int64_t n : points) {
      if (n < 1) return fault("has a WholeExtent that is empty");
    }
    if (auto done = add_image_data("PointData", points, piece.point_data); !done) return done;
    if (auto done = add_image_data("CellData", out_.whole.cells(), piece.cell_data); !done) {
      return done;
    }
    out_.pieces.push_back(std::move(piece));
    return {};
  }

  // Arrays have the dimensions [step] z y x [component]; flat images may lack those of length 1.
  Result<void> add_image_data(const std::string& name, const std::array<std::int64_t, 3>& counts,
                              std::vector<StoredArray>& arrays) {
    Counts64 full;
    Counts64 flat;
    for (std::size_t a = 3; a-- > 0;) {
      const auto n = static_cast<std::uint64_t>(counts.at(a));
      full.push_back(n);
      if (n > 1) flat.push_back(n);
    }
    for (const std::string& array : file_.datasets_in(group_ + '/' + name)) {
      const std::string path = path_of(name, array);
      auto offset = offset_of(name, array);
      if (!offset) return offset.error();
      const std::uint64_t index = offset->value_or(step_);
      bool found = false;
      for (const bool timed : {true, false}) {
        for (const Counts64& space : {full, flat}) {
          if (found || (timed && !has_steps_)) continue;
          auto part = image_part(path, space, timed, index);
          if (!part) return part.error();
          if (!*part) continue;
          arrays.push_back(std::move(**part));
          found = true;
        }
      }
      if (!found) out_.leave_out(array, "has dimensions other than those of the image");
    }
    return {};
  }

  // nullopt if the dimensions differ, or, with the reason recorded, if it is not readable.
  Result<std::optional<StoredArray>> image_part(const std::string& path, const Counts64& space,
                                                bool timed, std::uint64_t index) {
    const Counts64 all = file_.lengths(path);
    const std::size_t before = timed ? 1 : 0;
    const std::size_t wanted = before + space.size();
    const bool listed = all.size() == wanted + 1;  // has components
    if ((all.size() != wanted && !listed) ||
        !std::equal(space.begin(), space.end(),
                    all.begin() + static_cast<std::ptrdiff_t>(before))) {
      return std::optional<StoredArray>();
    }
    const std::uint64_t components = listed ? all.back() : 1;
    if (components < 1 || components > 1024) return std::optional<StoredArray>();
    Counts64 start(all.size(), 0);
    Counts64 count = all;
    if (timed) {
      if (index >= all.front()) {
        return fault("has " + std::to_string(all.front()) + " steps in " + in_quotes(path) +
                     ", but step " + std::to_string(index) + " is needed");
      }
      start.front() = index;
      count.front() = 1;
    }
    return taken(file_.array(path, start, count, static_cast<int>(components)), path);
  }

  // The array, or nullopt with the reason recorded.
  Result<std::optional<StoredArray>> taken(Result<StoredArray> array, const std::string& path) {
    if (array) return std::optional(std::move(*array));
    out_.leave_out(path.substr(path.rfind('/') + 1), array.error().message);
    return std::optional<StoredArray>();
  }

  // Without NumberOfParts each step has equally many; if all steps begin with the first part, those
  // are all of them. nullopt if they cannot be divided.
  std::optional<std::uint64_t> parts_of_each_step(std::uint64_t all) {
    const auto steps = file_.numbers(group_ + "/Steps", "NSteps", 1);
    if (!steps) return all;
    const auto count = whole_number(steps->front());
    const std::string offsets = group_ + "/Steps/PartOffsets";
    if (!count || *count < 1) return {};
    if (file_.lengths(offsets).empty()) return all;
    const auto begins = file_.values(offsets, 0, *count);
    if (!begins) return {};
    const auto is_first = [](double begin) { return begin == 0; };
    if (std::all_of(begins->begin(), begins->end(), is_first)) return all;
    return all % *count == 0 ? std::optional(all / *count) : std::nullopt;
  }

  Result<void> read_mesh_parts() {
    out_.kind = Kind::unstructured;
    out_.format = "VTKHDF unstructured grid";
    const Counts64 listed = file_.lengths(group_ + "/NumberOfPoints");
    if (listed.size() != 1) return fault("has no list NumberOfPoints");
    std::array<std::uint64_t, 3> begin{};  // of points, cells and indices of this step
    const std::array<const char*, 3> names{"PointOffsets", "CellOffsets", "ConnectivityIdOffsets"};
    for (std::size_t n = 0; n < 3; ++n) {
      const auto found = of_step(names.at(n));
      if (!found) return found.error();
      begin.at(n) = found->value_or(0);
    }
    const auto first_part = of_step("PartOffsets");
    if (!first_part) return first_part.error();
    const auto part_count = of_step("NumberOfParts");
    if (!part_count) return part_count.error();
    const std::uint64_t part = first_part->value_or(0);
    if (part > listed.front()) return fault("has a PartOffset beyond its parts");
    auto parts = *part_count;
    if (!parts) parts = parts_of_each_step(listed.front());
    if (!parts) return fault("has no NumberOfParts of its steps");
    if (*parts > hdf_parts_max) {
      return fault("has more than " + std::to_string(hdf_parts_max) + " parts");
    }
    std::array<std::vector<double>, 3> sizes;
    const std::array<const char*, 3> counts{"NumberOfPoints", "NumberOfCells",
                                            "NumberOfConnectivityIds"};
    for (std::size_t n = 0; n < 3; ++n) {
      auto found = file_.values(group_ + '/' + counts.at(n), part, *parts);
      if (!found) return found.error();
      sizes.at(n) = std::move(*found);
    }
    if (auto done = find_bases(begin); !done) return done;
    std::array<std::uint64_t, 3> done{};  // of the parts before
    for (std::size_t p = 0; p < *parts; ++p) {
      std::array<std::uint64_t, 3> size{};
      for (std::size_t n = 0; n < 3; ++n) {
        const auto number = whole_number(sizes.at(n)[p]);
        if (!number) return fault("has no valid number in " + in_quotes(counts.at(n)));
        size.at(n) = *number;
      }
      if (size[0] > 0) {
        auto added = add_part(begin, done, size, part + p);
        if (!added) return added;
      }
      for (std::size_t n = 0; n < 3; ++n) done.at(n) += size.at(n);
    }
    return {};
  }

  // The first tuple of each array in this step.
  Result<void> find_bases(const std::array<std::uint64_t, 3>& begin) {
    for (const std::size_t n : {0U, 1U}) {
      const std::string group = n == 0 ? "PointData" : "CellData";
      for (const std::string& array : file_.datasets_in(group_ + '/' + group)) {
        const auto offset = offset_of(group, array);
        if (!offset) return offset.error();
        fields_.push_back({n == 0, array, offset->value_or(begin.at(n))});
      }
    }
    return {};
  }

  // before: points, cells and indices of the parts before in this step; `number`: of the part.
  Result<void> add_part(const std::array<std::uint64_t, 3>& begin,
                        const std::array<std::uint64_t, 3>& before,
                        const std::array<std::uint64_t, 3>& size, std::uint64_t number) {
    Piece piece;
    piece.points = size[0];
    piece.cells = size[1];
    auto points = file_.array(group_ + "/Points", {begin[0] + before[0], 0}, {size[0], 3}, 3);
    if (!points) return points.error();
    piece.coordinates.push_back(std::move(*points));
    if (size[1] > 0) {
      // Each part before, of all steps, has one more offset than cells.
      const std::uint64_t offset = begin[1] + before[1] + number;
      auto ends = file_.array(group_ + "/Offsets", {offset}, {size[1] + 1}, 1);
      auto types = file_.array(group_ + "/Types", {begin[1] + before[1]}, {size[1]}, 1);
      auto corners = file_.array(group_ + "/Connectivity", {begin[2] + before[2]}, {size[2]}, 1);
      if (!ends) return ends.error();
      if (!types) return types.error();
      if (!corners) return corners.error();
      piece.offsets = std::move(*ends);
      piece.types = std::move(*types);
      piece.connectivity = std::move(*corners);
      piece.offsets_from_zero = true;
    }
    for (const Field& field : fields_) {
      const std::string path =
          group_ + (field.of_points ? "/PointData/" : "/CellData/") + field.name;
      const Counts64 all = file_.lengths(path);
      const std::uint64_t components = all.size() == 2 ? all.back() : 1;
      if (all.empty() || all.size() > 2 || components < 1 || components > 1024) {
        out_.leave_out(field.name, "has dimensions other than tuples and components");
        continue;
      }
      const std::size_t n = field.of_points ? 0 : 1;
      Counts64 start{field.base + before.at(n)};
      Counts64 count{size.at(n)};
      if (all.size() == 2) {
        start.push_back(0);
        count.push_back(components);
      }
      auto array = taken(file_.array(path, start, count, static_cast<int>(components)), path);
      if (!array) return array.error();
      if (*array) (field.of_points ? piece.point_data : piece.cell_data).push_back(**array);
    }
    out_.pieces.push_back(std::move(piece));
    return {};
  }

  struct Field {
    bool of_points = true;
    std::string name;
    std::uint64_t base = 0;
  };

  HdfFile& file_;
  std::string group_;
  std::size_t step_;
  bool has_steps_ = false;
  std::vector<Field> fields_;
  Snapshot out_;
};

// The groups of blocks, in the order of their attribute Index.
std::vector<std::string> block_groups(const HdfFile& file) {
  std::vector<std::pair<double, std::string>> found;
  for (const std::string& name : file.groups_in(root_group)) {
    const std::string group = std::string(root_group) + '/' + name;
    if (!file.text(group, "Type")) continue;
    const auto index = file.numbers(group, "Index", 1);
    found.emplace_back(index ? index->front() : 1e9, name);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> out;
  out.reserve(found.size());
  for (auto& one : found) out.push_back(std::move(one.second));
  return out;
}

}  // namespace

bool has_blocks(const HdfFile& file) {
  const std::string type = file.text(root_group, "Type").value_or("");
  return type == "PartitionedDataSetCollection" || type == "MultiBlockDataSet";
}

Result<std::vector<std::optional<double>>> times_of(HdfFile& file) {
  std::string group = root_group;
  if (has_blocks(file)) {
    const auto blocks = block_groups(file);
    const bool own = file.numbers(group + "/Steps", "NSteps", 1).has_value();
    if (!own && !blocks.empty()) group += '/' + blocks.front();
  }
  const auto count = file.numbers(group + "/Steps", "NSteps", 1);
  if (!count) return std::vector<std::optional<double>>(1);
  const auto steps = whole_number(count->front());
  if (!steps || *steps < 1 || *steps > hdf_steps_max) {
    return file.input()->fault("has a number of steps outside 1 to " +
                               std::to_string(hdf_steps_max));
  }
  std::vector<std::optional<double>> out(static_cast<std::size_t>(*steps));
  if (file.lengths(group + "/Steps/Values").empty()) return out;
  const auto values = file.values(group + "/Steps/Values", 0, *steps);
  if (!values) return values.error();
  for (std::size_t s = 0; s < out.size(); ++s) {
    if (std::isfinite((*values)[s])) out[s] = (*values)[s];
  }
  return out;
}

Result<std::vector<Block>> read_hdf(HdfFile& file, std::size_t step, const std::string& inside) {
  const auto version = file.numbers(root_group, "Version", 2);
  if (version && !(version->front() >= 1 && version->front() < 3)) {
    return file.input()->fault("has a version of VTKHDF other than 1 and 2");
  }
  const std::string type = file.text(root_group, "Type").value_or("");
  std::vector<Block> out;
  const auto add = [&](const std::string& name, const std::string& group,
                       const std::string& kind) -> Result<void> {
    if (kind != "ImageData" && kind != "UnstructuredGrid") {
      out.push_back({name, kind, {}});
      return {};
    }
    auto snapshot = HdfGrid(file, group, step).read(kind);
    if (!snapshot) return snapshot.error();
    out.push_back({name, "", std::move(*snapshot)});
    return {};
  };
  if (!has_blocks(file)) {
    if (type != "ImageData" && type != "UnstructuredGrid") {
      return file.input()->fault(
          "holds VTKHDF data of the type " + in_quotes(type) +
          "; supported types: ImageData, UnstructuredGrid, PartitionedDataSetCollection and "
          "MultiBlockDataSet");
    }
    if (auto done = add("", root_group, type); !done) return done.error();
    if (out.front().snapshot->pieces.empty()) return file.input()->fault("has empty parts only");
    return out;
  }
  std::string known;
  for (const std::string& name : block_groups(file)) {
    known += (known.empty() ? "" : ", ") + in_quotes(name);
    if (!inside.empty() && name != inside) continue;
    const std::string group = std::string(root_group) + '/' + name;
    if (auto done = add(name, group, file.text(group, "Type").value_or("")); !done) {
      return done.error();
    }
  }
  if (!out.empty()) return out;
  return make_error(ErrorKind::not_found,
                    in_quotes(file.input()->name()) +
                        (inside.empty() ? " has no blocks"
                                        : " has no block " + in_quotes(inside) +
                                              "; its blocks: " + known.substr(0, 1000)));
}

}  // namespace windsplat::data::vtk
