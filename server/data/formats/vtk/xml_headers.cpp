// XML files of VTK that refer to others: parallel headers, multi-block files, collections.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/vtk/xml_document.hpp"

namespace windsplat::data::vtk {

namespace {

using pugi::xml_node;

constexpr int nesting_max = 32;  // blocks within blocks
constexpr std::size_t name_bytes_max = 512;

std::vector<Declared> declared_in(const xml_node& group) {
  std::vector<Declared> out;
  for (const xml_node node : group.children()) {
    const std::string_view kind = node.name();
    if (kind != "PDataArray" && kind != "DataArray" && kind != "PArray") continue;
    const auto components = bytes::to_integer(node.attribute("NumberOfComponents").as_string("1"));
    out.push_back({node.attribute("Name").as_string("unnamed"), node.attribute("type").value(),
                   components && *components >= 0 && *components <= 1024
                       ? static_cast<int>(*components)
                       : 0});
  }
  return out;
}

// "fluid/2": the names of a block and of those around it.
std::string name_below(const std::string& above, const xml_node& node, std::size_t number) {
  std::string name = node.attribute("name").value();
  if (name.empty()) name = node.attribute("index").as_string(std::to_string(number).c_str());
  return above.empty() ? name : above + '/' + name;
}

Result<void> add_blocks(const Document& document, const xml_node& group, const std::string& above,
                        int depth, std::vector<BlockFile>& out) {
  if (depth > nesting_max) {
    return document.file()->fault("has blocks within blocks, more than " +
                                  std::to_string(nesting_max) + " deep");
  }
  std::size_t number = 0;
  for (const xml_node node : group.children()) {
    const std::string_view kind = node.name();
    const bool is_group = kind == "Block" || kind == "Piece" || kind == "Partitions";
    if (!is_group && kind != "DataSet") continue;
    const std::string name = name_below(above, node, number++);
    if (name.size() > name_bytes_max) {
      return document.file()->fault("has a block whose name has more than " +
                                    std::to_string(name_bytes_max) + " bytes");
    }
    if (is_group) {
      if (auto done = add_blocks(document, node, name, depth + 1, out); !done) return done;
    } else if (const std::string source = node.attribute("file").value(); !source.empty()) {
      out.push_back({name, source});  // an empty block has no file
    }
  }
  return {};
}

}  // namespace

Result<ParallelHeader> read_parallel_header(const Document& document, const GridType& type) {
  const auto& file = document.file();
  const xml_node set = document.root().child(document.type().c_str());
  if (!set) return file->fault("has no element " + in_quotes(document.type()));
  ParallelHeader out;
  const bool has_extent = type.kind != Kind::unstructured;
  if (has_extent && !extent_of(set.attribute("WholeExtent").value(), out.whole)) {
    return file->fault("has no WholeExtent of six whole numbers within 2^31");
  }
  const auto level = bytes::to_integer(set.attribute("GhostLevel").as_string("0"));
  if (!level || *level < 0 || *level > 1024) {
    return file->fault("has a GhostLevel outside 0 to 1024");
  }
  out.ghost_level = *level;
  if (type.kind == Kind::image) {
    if (auto done = document.read_placement(set, out.place); !done) return done.error();
  }
  out.point_data = declared_in(set.child("PPointData"));
  out.cell_data = declared_in(set.child("PCellData"));
  if (out.point_data.size() + out.cell_data.size() > piece_arrays_max) {
    return file->fault("declares more than " + std::to_string(piece_arrays_max) +
                       " arrays of points and cells");
  }
  for (const xml_node piece : set.children("Piece")) {
    ParallelHeader::Member member;
    member.source = piece.attribute("Source").value();
    const std::string named = "the piece " + std::to_string(out.members.size());
    if (member.source.empty()) return file->fault("has no Source for " + named);
    if (Extent extent; has_extent) {
      if (!extent_of(piece.attribute("Extent").value(), extent)) {
        return file->fault("has no Extent of six whole numbers within 2^31 for " + named);
      }
      member.extent = extent;
    }
    out.members.push_back(std::move(member));
  }
  if (out.members.empty()) return file->fault("has no piece and so no data");
  return out;
}

bool has_blocks(const std::string& type) {
  return type == "vtkMultiBlockDataSet" || type == "vtkPartitionedDataSet" ||
         type == "vtkPartitionedDataSetCollection";
}

Result<std::vector<BlockFile>> read_blocks(const Document& document) {
  std::vector<BlockFile> out;
  const xml_node set = document.root().child(document.type().c_str());
  if (auto done = add_blocks(document, set, "", 0, out); !done) return done.error();
  if (out.empty()) return document.file()->fault("has no block with a file");
  return out;
}

Result<Collection> read_collection(const Document& document) {
  const auto& file = document.file();
  struct Listed {
    double time;
    BlockFile part;
  };
  std::vector<Listed> listed;
  for (const xml_node node : document.root().child("Collection").children("DataSet")) {
    const std::string source = node.attribute("file").value();
    const auto text = node.attribute("timestep");
    const auto time = text ? bytes::to_sample(trim(text.value()))
                           : std::optional(static_cast<double>(listed.size()));
    if (source.empty() || !time || !std::isfinite(*time)) {
      return file->fault("has a DataSet without a file, or with a timestep that is not a number");
    }
    std::string name = node.attribute("name").value();
    if (name.empty()) name = node.attribute("part").as_string("0");
    listed.push_back({*time, {std::move(name), source}});
  }
  if (listed.empty()) return file->fault("is a collection without a DataSet");
  std::stable_sort(listed.begin(), listed.end(),
                   [](const Listed& a, const Listed& b) { return a.time < b.time; });
  Collection out;
  std::set<std::string> named;  // files of the timestep
  for (Listed& one : listed) {
    if (out.members.empty() || out.members.back().time != one.time) {
      out.members.push_back({one.time, {}});
      named.clear();
    }
    if (!named.insert(one.part.source).second) {
      return file->fault("names " + in_quotes(one.part.source) + " twice for a timestep");
    }
    out.members.back().parts.push_back(std::move(one.part));
  }
  return out;
}

}  // namespace windsplat::data::vtk
