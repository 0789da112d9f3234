// Opens the files of a step from the top down and checks that they agree.
#include "server/data/formats/vtk/step_reader.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/byte_store.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/formats/vtk/source.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::vtk {

namespace {

// Files of a step that stay open; a loader may have 256 besides the members of a series.
constexpr std::size_t kept_open_max = 64;

// The name of a file that `by` refers to, relative to the folder of the dataset.
std::string beside(const std::string& by, std::string source) {
  while (source.starts_with("./")) source.erase(0, 2);
  const std::size_t slash = by.rfind('/');
  // Absolute names stay absolute and are refused when opened.
  if (slash == std::string::npos || source.starts_with('/')) return source;
  return by.substr(0, slash + 1) + source;
}

bool is_empty(const Extent& extent) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (extent.last[a] < extent.first[a]) return true;
  }
  return false;
}

bool same_placement(const Placement& a, const Placement& b) {
  const auto close = [](double one, double other, double unit) {
    return std::abs(one - other) <= 1e-5 * std::abs(unit);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    if (!close(a.origin[i], b.origin[i], a.spacing[i]) ||
        !close(a.spacing[i], b.spacing[i], a.spacing[i])) {
      return false;
    }
  }
  for (std::size_t i = 0; i < 9; ++i) {
    if (!close(a.direction.at(i), b.direction.at(i), 1)) return false;
  }
  return true;
}

std::string described(const std::string& type, int components) {
  return std::to_string(components) + " x " + type;
}

// The difference of an array of a piece from its declaration; empty if there is none.
std::string difference(const Declared& declared, const StoredArray* array, const std::string& piece,
                       const std::string& header) {
  if (array == nullptr) return "is missing in the piece " + in_quotes(piece);
  const std::string type = bytes::name_of(array->type);
  const bool same = (declared.type.empty() || lower(declared.type) == type) &&
                    declared.components == array->components;
  if (same) return "";
  return "is " + described(type, array->components) + " in the piece " + in_quotes(piece) +
         ", but " + described(lower(declared.type), declared.components) + " in " +
         in_quotes(header);
}

// Leaves out the arrays that header and pieces do not agree on.
void keep_declared(const std::string& header, const std::vector<Declared>& declared, PieceData data,
                   Snapshot& snapshot) {
  for (const std::string& name : array_names(snapshot, data)) {
    const auto at = std::find_if(declared.begin(), declared.end(),
                                 [&](const Declared& one) { return one.name == name; });
    if (at != declared.end()) continue;
    snapshot.leave_out(name, "is in pieces, but not declared in " + in_quotes(header));
    erase_array(snapshot, data, name);
  }
  for (const Declared& one : declared) {
    if (one.name == ghost_name || one.name == ghost_levels_name) continue;
    for (const Piece& piece : snapshot.pieces) {
      const std::string differs =
          difference(one, find_array(piece.*data, one.name), piece.file.name, header);
      if (differs.empty()) continue;
      snapshot.leave_out(one.name, differs);
      erase_array(snapshot, data, one.name);
      break;
    }
  }
}

Error without_blocks(const std::string& name, const std::string& inside) {
  return make_error(ErrorKind::not_found, in_quotes(name) + " has a format without groups: " +
                                              in_quotes("#/" + inside) + " does not exist");
}

std::string list_of(const std::vector<BlockFile>& blocks) {
  constexpr std::size_t listed_max = 16;
  std::string out;
  for (std::size_t b = 0; b < std::min(blocks.size(), listed_max); ++b) {
    out += (b > 0 ? ", " : "") + in_quotes(blocks[b].name);
  }
  if (blocks.size() > listed_max) {
    out += " and " + std::to_string(blocks.size() - listed_max) + " more";
  }
  return out;
}

Result<std::vector<std::optional<double>>> times_in(Files& files, const std::string& name) {
  auto file = files.open(name);
  if (!file) return file.error();
  auto hdf = HdfFile::open(std::move(*file));
  if (!hdf) return hdf.error();
  return times_of(**hdf);
}

// The steps of VTKHDF files, each of which may have several. A damaged file of a series is a step
// that cannot be read.
Result<std::vector<Step>> steps_in_files(Files& files) {
  std::vector<Step> steps;
  const bool in_series = files.location().kind == Location::Kind::series;
  for (const auto& member : files.location().members) {
    const auto times = times_in(files, member.name);
    if (!times && in_series && times.error().kind == ErrorKind::bad_data) {
      steps.push_back({{{"", member.name}}, {}, {}, ""});
      continue;
    }
    if (!times) return times.error();
    for (std::size_t index = 0; index < times->size(); ++index) {
      steps.push_back({{{"", member.name}}, index, (*times)[index], ""});
    }
  }
  return steps;
}

}  // namespace

bool is_vtkhdf(Files& files) {
  for (const Location::Member& member : files.location().members) {
    const auto file = files.open(member.name);
    const auto found = file ? HdfFile::has_vtkhdf(**file) : std::nullopt;
    if (found) return *found;
  }
  return false;
}

Result<std::vector<Step>> steps_of(Files& files) {
  if (is_vtkhdf(files)) return steps_in_files(files);
  std::vector<Step> steps;
  for (const auto& member : files.location().members) {
    steps.push_back({{{"", member.name}}, {}, {}, ""});
  }
  auto file = files.open(steps.front().parts.front().source);
  const bool in_series = files.location().kind == Location::Kind::series;
  for (std::size_t s = 1; in_series && !file && s < steps.size(); ++s) {
    file = files.open(steps[s].parts.front().source);
  }
  if (!file) return file.error();
  if (files.location().kind != Location::Kind::file) return steps;
  const auto head = (*file)->head(head_bytes);
  if (!head) return head.error();
  if (!is_xml(*head) || head->find("Collection") == std::string::npos) return steps;
  Document document(*file);
  if (auto done = document.load(); !done) return done.error();
  if (document.type() != "Collection") return steps;
  auto collection = read_collection(document);
  if (!collection) return collection.error();
  steps.clear();
  for (auto& member : collection->members) {
    steps.push_back({std::move(member.parts), {}, member.time, ""});
  }
  return steps;
}

Result<Snapshot> StepReader::read(const Step& step) {
  opened_ = 0;
  identities_.clear();
  auto out = [&]() -> Result<Snapshot> {
    if (step.parts.size() == 1) return read_one(step.parts.front().source, step.index);
    auto file = open(step.parts.front().source, "");
    if (!file) return file.error();
    return read_blocks(*file, "", step.parts);
  }();
  if (!out) return out;
  out->identity = opened_ == 1 ? out->file->identity() : digest_of(identities_);
  return out;
}

Result<StepReader::FilePtr> StepReader::open(const std::string& name, const std::string& by) {
  if (++opened_ > step_files_max) {
    return make_error(ErrorKind::bad_data, in_quotes(by) + " refers to more than " +
                                               std::to_string(step_files_max) + " files");
  }
  auto file = by.empty() ? files_.open(name) : bytes::open_named(files_, name, by);
  if (file) identities_ += (*file)->identity() + '\n';
  return file;
}

PieceFile StepReader::keep(const FilePtr& file, const std::string& name) {
  return {opened_ <= kept_open_max ? file : nullptr, name, file->identity()};
}

Result<Snapshot> StepReader::read_one(const std::string& name, std::optional<std::size_t> index) {
  const auto file = open(name, "");
  if (!file) return file.error();
  if (HdfFile::is_vtkhdf(**file)) return read_grids(*file, index);
  const auto head = (*file)->head(head_bytes);
  if (!head) return head.error();
  const bool legacy = is_legacy(*head);
  if (!legacy && !is_xml(*head)) {
    return (*file)->fault(head->starts_with("\x89HDF")
                              ? "is an HDF5 file that is damaged, or has no group VTKHDF"
                              : "is not a VTK file");
  }
  auto out = legacy ? read_legacy(*file) : read_xml(*file, name);
  if (!out) return out;
  out->file = *file;
  if (!inside_.empty() && out->blocks.empty()) {
    return without_blocks(name, inside_);
  }
  for (Piece& piece : out->pieces) {
    if (piece.file.name.empty()) piece.file = keep(*file, name);
    if (out->blocks.empty()) piece.kind = out->kind;
  }
  return out;
}

// The grids of a step of a VTKHDF file. It is opened once for all steps.
Result<Snapshot> StepReader::read_grids(const FilePtr& file, std::optional<std::size_t> index) {
  if (!hdf_ || hdf_->input()->identity() != file->identity()) {
    auto opened = HdfFile::open(file);
    if (!opened) return opened.error();
    hdf_ = std::move(*opened);
  }
  if (!inside_.empty() && !has_blocks(*hdf_)) return without_blocks(file->name(), inside_);
  if (!index) {
    const auto times = times_of(*hdf_);
    if (!times) return times.error();
    if (times->size() > 1) {
      return file->fault("has " + std::to_string(times->size()) +
                         " steps; open it by itself: a collection names files of one step");
    }
  }
  auto grids = read_hdf(*hdf_, index.value_or(0), inside_);
  if (!grids) return grids.error();
  for (Block& grid : *grids) {
    if (!grid.snapshot) continue;
    for (Piece& piece : grid.snapshot->pieces) piece.file = {hdf_->input(), file->name(), ""};
  }
  if (!has_blocks(*hdf_) && grids->front().snapshot) {
    Snapshot out = std::move(*grids->front().snapshot);
    out.file = hdf_->input();
    return out;
  }
  auto out = unite(files_, hdf_->input(), std::move(*grids));
  if (out) out->file = hdf_->input();
  return out;
}

Result<Snapshot> StepReader::read_xml(const FilePtr& file, const std::string& name) {
  Document document(file);
  if (auto done = document.load(); !done) return done.error();
  if (const auto type = grid_type(document.type())) {
    return type->parallel ? read_parallel(document, *type, name)
                          : read_serial(document, *type, Part::whole);
  }
  if (has_blocks(document.type())) {
    const auto all = vtk::read_blocks(document);
    if (!all) return all.error();
    auto out = read_blocks(file, name, *all);
    if (!out) return out;
    // foamToVTK writes the time beside the blocks.
    const pugi::xml_node root = document.root();
    for (const pugi::xml_node& around : {root, root.child(document.type().c_str())}) {
      auto done = document.read_time(around.child("FieldData"), *out);
      if (!done) return done.error();
    }
    return out;
  }
  return file->fault("holds VTK data of the type " + in_quotes(document.type()) +
                     "; supported types: ImageData, RectilinearGrid, StructuredGrid, "
                     "UnstructuredGrid, their parallel forms, vtkMultiBlockDataSet, "
                     "vtkPartitionedDataSet, vtkPartitionedDataSetCollection and Collection");
}

Result<Snapshot> StepReader::read_parallel(const Document& document, const GridType& type,
                                           const std::string& name) {
  const auto header = read_parallel_header(document, type);
  if (!header) return header.error();
  Snapshot out;
  out.kind = type.kind;
  out.format = type.format;
  out.whole = header->whole;
  out.place = header->place;
  const pugi::xml_node set = document.root().child(document.type().c_str());
  if (auto done = document.read_time(set.child("FieldData"), out); !done) return done.error();
  for (const auto& member : header->members) {
    if (member.extent && is_empty(*member.extent)) continue;
    if (auto done = add_piece(*header, member, name, out); !done) return done.error();
  }
  if (out.pieces.empty()) return document.file()->fault("has empty pieces only");
  if (out.kind != Kind::unstructured) {
    if (auto done = check_cover(*document.file(), out); !done) return done.error();
    auto done = check_overlap(*document.file(), out, header->ghost_level);
    if (!done) return done.error();
  }
  keep_declared(name, header->point_data, &Piece::point_data, out);
  keep_declared(name, header->cell_data, &Piece::cell_data, out);
  return out;
}

// Reads the header of one piece and compares it with that of the parallel file.
Result<void> StepReader::add_piece(const ParallelHeader& header,
                                   const ParallelHeader::Member& member, const std::string& name,
                                   Snapshot& out) {
  const std::string source = beside(name, member.source);
  const auto file = open(source, name);
  if (!file) return file.error();
  Document document(*file);
  if (auto done = document.load(); !done) return done;
  const auto type = grid_type(document.type());
  if (!type || type->parallel || type->kind != out.kind) {
    return (*file)->fault("has the type " + in_quotes(document.type()) +
                          ", which is not that of a piece of " + in_quotes(name));
  }
  auto part = read_serial(document, *type, Part::of_step);
  if (!part) return part.error();
  if (out.kind == Kind::image && !part->pieces.empty() &&
      !same_placement(header.place, part->place)) {
    return (*file)->fault("has another Origin, Spacing or Direction than " + in_quotes(name));
  }
  std::uint64_t points = 0;
  for (Piece& piece : part->pieces) {
    if (member.extent && !member.extent->holds(piece.extent)) {
      return (*file)->fault("has a piece with the extent " + text_of(piece.extent) + ", but " +
                            in_quotes(name) + " declares " + text_of(*member.extent));
    }
    points += piece.points;
    piece.file = keep(*file, source);
    out.pieces.push_back(std::move(piece));
  }
  if (member.extent) {
    std::uint64_t wanted = 1;
    for (const std::int64_t n : member.extent->points()) wanted *= static_cast<std::uint64_t>(n);
    if (points < wanted) {
      return (*file)->fault("has " + std::to_string(points) + " points, but " + in_quotes(name) +
                            " declares the extent " + text_of(*member.extent) + " of " +
                            std::to_string(wanted));
    }
  }
  if (!out.time) out.time = part->time;
  for (const LeftOut& left : part->left_out) out.leave_out(left.name, left.reason);
  return {};
}

Result<std::vector<BlockFile>> StepReader::chosen(const InputFile& file,
                                                  const std::vector<BlockFile>& all) const {
  if (inside_.empty()) return all;
  std::vector<BlockFile> out;
  std::copy_if(all.begin(), all.end(), std::back_inserter(out), [&](const BlockFile& block) {
    return block.name == inside_ || block.name.starts_with(inside_ + '/');
  });
  if (!out.empty()) return out;
  return make_error(ErrorKind::not_found, in_quotes(file.name()) + " has no block " +
                                              in_quotes(inside_) + "; its blocks: " + list_of(all));
}

Result<Snapshot> StepReader::read_blocks(const FilePtr& file, const std::string& name,
                                         const std::vector<BlockFile>& all) {
  const auto parts = chosen(*file, all);
  if (!parts) return parts.error();
  std::vector<Block> blocks;
  for (const BlockFile& part : *parts) {
    auto block = read_block({part.name, beside(name, part.source)}, name);
    if (!block) return block.error();
    blocks.push_back(std::move(*block));
  }
  auto out = unite(files_, file, std::move(blocks));
  if (out) out->file = file;
  return out;
}

Result<Block> StepReader::read_block(const BlockFile& part, const std::string& by) {
  const auto file = open(part.source, by);
  if (!file) return file.error();
  const auto head = (*file)->head(head_bytes);
  if (!head) return head.error();
  Block out{part.name, "", {}};
  if (is_legacy(*head)) {
    auto snapshot = read_legacy(*file);
    if (!snapshot) return snapshot.error();
    for (Piece& piece : snapshot->pieces) piece.file = keep(*file, part.source);
    out.snapshot = std::move(*snapshot);
    return out;
  }
  if (!is_xml(*head)) return (*file)->fault("is not a VTK file");
  Document document(*file);
  if (auto done = document.load(); !done) return done.error();
  const auto type = grid_type(document.type());
  if (has_blocks(document.type()) || document.type() == "Collection") {
    return (*file)->fault("has the type " + in_quotes(document.type()) +
                          ", which cannot be a block or part of another file");
  }
  if (!type) {
    out.other_type = document.type();
    return out;
  }
  auto snapshot = type->parallel ? read_parallel(document, *type, part.source)
                                 : read_serial(document, *type, Part::of_step);
  if (!snapshot) return snapshot.error();
  if (!type->parallel && type->kind != Kind::unstructured && !snapshot->pieces.empty()) {
    if (auto done = check_cover(**file, *snapshot); !done) return done.error();
  }
  for (Piece& piece : snapshot->pieces) {
    if (piece.file.name.empty()) piece.file = keep(*file, part.source);
  }
  out.snapshot = std::move(*snapshot);
  return out;
}

}  // namespace windsplat::data::vtk
