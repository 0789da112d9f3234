// The files referenced by a DX file, each parsed once, and the locations of array data.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/byte_store.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/dx/module.hpp"
#include "server/data/formats/plain/placed_file.hpp"

namespace windsplat::data::dx {

// An object and its file.
struct Found {
  const Module* module = nullptr;
  const Object* object = nullptr;
};

class Library {
 public:
  explicit Library(std::shared_ptr<Files> files) : files_(std::move(files)) {}

  Result<Found> root(const std::shared_ptr<const InputFile>& file);
  // Errors: bad_data, not_found.
  Result<Found> find(const Found& from, const Reference& reference);

  // Location of the numbers of an array, from its `items` and `shape`; the caller sets the strides.
  Result<bytes::Placement> place(const Found& array);
  // All numbers of a small array.
  Result<std::vector<double>> numbers(const Found& array, std::uint64_t count_max);
  // Identity of all opened files.
  [[nodiscard]] std::string identity() const { return identity_; }

 private:
  Result<std::shared_ptr<const InputFile>> open(const std::string& name);

  std::shared_ptr<Files> files_;
  std::map<std::string, std::shared_ptr<const InputFile>> opened_;
  std::map<std::string, std::unique_ptr<Module>> modules_;
  std::string identity_;
};

}  // namespace windsplat::data::dx
