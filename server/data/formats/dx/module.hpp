// The objects of one OpenDX file (native format) as plain data, with references to other files.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::dx {

// An object by its name or number, in this file or in another one.
struct Reference {
  std::string file;  // empty: the same file
  std::string name;  // empty: the last object of the file
};

struct Member {
  std::string name;     // name of a component or of a member of a group
  double position = 0;  // in a series
  Reference value;
};

enum class Class {
  array,
  grid_positions,
  grid_connections,
  regular,
  product,
  field,
  series,
  group,
  other
};

struct Object {
  Class kind = Class::other;
  std::string name;
  std::string class_name;
  std::map<std::string, std::string> attributes;
  // array
  bytes::Scalar type = bytes::Scalar::float32;
  bool numbers = true;  // false: strings, complex numbers
  std::vector<std::uint64_t> shape;
  std::uint64_t items = 0;
  bool has_data = false;
  bool text = true;
  bool big_endian = false;
  bool follows = false;  // true: data at `data_at` of this file; false: after its last line
  std::uint64_t data_at = 0;
  std::string data_file;  // file of external data
  // grids and regular arrays
  std::vector<std::uint64_t> counts;
  std::vector<double> origin;
  std::vector<std::vector<double>> deltas;
  // product: terms; field: components; series, group: members
  std::vector<Member> members;
};

struct Module {
  std::shared_ptr<const InputFile> file;
  std::vector<Object> objects;
  std::string chosen;            // the object named by `default`; empty: the last one
  std::uint64_t data_begin = 0;  // after the line `end`

  [[nodiscard]] const Object* find(const std::string& name) const;  // null if there is none
};

// Errors: bad_data with the byte offset.
Result<Module> parse_module(const std::shared_ptr<const InputFile>& file);

}  // namespace windsplat::data::dx
