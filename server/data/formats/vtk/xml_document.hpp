// One XML file of VTK (.vti .vtr .vts .vtu, their parallel headers, .vtm .vtpd .vtpc .pvd): its
// elements, and the places of its arrays in the file.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

namespace windsplat::data::vtk {

class Document {
 public:
  explicit Document(std::shared_ptr<const InputFile> file) : file_(std::move(file)) {}

  // Errors: bad_data, also for more than 256 MiB of text, 1,000,000 elements or 4,000,000
  // attributes.
  Result<void> load();

  [[nodiscard]] pugi::xml_node root() const { return root_; }
  [[nodiscard]] std::string type() const { return root_.attribute("type").value(); }
  [[nodiscard]] const std::shared_ptr<const InputFile>& file() const { return file_; }

  // Appends the arrays of an element, which have `tuples` tuples; leaves out arrays of types that
  // are not numbers. Errors: bad_data.
  Result<void> read_arrays(const pugi::xml_node& group, std::uint64_t tuples, Snapshot& out,
                           std::vector<StoredArray>& arrays) const;
  // The time in FieldData.
  Result<void> read_time(const pugi::xml_node& group, Snapshot& out) const;
  // Origin, Spacing and Direction of an image.
  Result<void> read_placement(const pugi::xml_node& set, Placement& out) const;

 private:
  struct Text {
    std::string text;           // the XML part, without appended data
    bool has_appended = false;  // the tag of appended data begins at text.size()
  };
  static Result<Text> xml_part(const InputFile& file);
  Result<void> find_appended();
  Result<void> find_coding();
  Result<std::optional<StoredArray>> array_of(const pugi::xml_node& node, std::uint64_t tuples,
                                              Snapshot& out) const;
  Result<void> place(const pugi::xml_node& node, StoredArray& array) const;

  std::shared_ptr<const InputFile> file_;
  Text text_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  Coding coding_;
  bool appended_base64_ = false;
  std::uint64_t appended_at_ = 0;
};

// Six whole numbers within 2^31.
bool extent_of(std::string_view text, Extent& out);

// A data set of a serial file, or its counterpart in a parallel header.
struct GridType {
  Kind kind = Kind::image;
  bool parallel = false;
  std::string format;  // "VTK image data"
};
// nullopt for other types ("PolyData").
std::optional<GridType> grid_type(const std::string& type);

// The grid of a serial file. Errors: bad_data.
Result<Snapshot> read_serial(const Document& document, const GridType& type, Part part);

// The name, type and number of components of an array in a parallel header.
struct Declared {
  std::string name;
  std::string type;
  int components = 1;
};
// The header of a parallel file.
struct ParallelHeader {
  struct Member {
    std::string source;  // relative to the folder of the header
    std::optional<Extent> extent;
  };
  Extent whole;
  std::int64_t ghost_level = 0;
  Placement place;
  std::vector<Declared> point_data;
  std::vector<Declared> cell_data;
  std::vector<Member> members;
};
// Errors: bad_data.
Result<ParallelHeader> read_parallel_header(const Document& document, const GridType& type);

// The blocks of a multi-block file, or of partitioned data sets, in order.
struct BlockFile {
  std::string name;  // "fluid/inner"; a block without a name has its index
  std::string source;
};
bool has_blocks(const std::string& type);
// Errors: bad_data, also for blocks more than 32 deep.
Result<std::vector<BlockFile>> read_blocks(const Document& document);

// The data sets of a .pvd file in the order of their times.
struct Collection {
  struct Member {
    double time = 0;
    std::vector<BlockFile> parts;
  };
  std::vector<Member> members;
};
// Errors: bad_data.
Result<Collection> read_collection(const Document& document);

}  // namespace windsplat::data::vtk
