// Whether a store is as it was written: checksums of all files, and its numbers made anew.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/convert/convert.hpp"

namespace windsplat::convert {

// What a store says of how it was made.
struct Recorded {
  std::vector<std::string> fields;
  std::vector<std::size_t> steps;  // of the input
  std::string compression;
  int zarr = 3;
  bool same_program = true;  // the one that checks
  std::string program;
  std::size_t files = 0;
  std::uint64_t bytes = 0;
};

// Compares every file with its checksum. Errors: not_found, cancelled; bad_data: it was not made by
// convert(); files differ, are missing or do not belong to it: the message names the first.
Result<Recorded> check_files(const std::filesystem::path& store, const CancelToken& cancel,
                             const ShowDone& progress);

// Makes all arrays again from a source, in a folder beside the store of which a few units exist at
// a time, and compares them by their checksums: with the input as the source, full detail is that
// of the input; with the store, coarser levels and statistics are those of its full detail. Errors:
// bad_data: the message names the first array that differs; those of convert().
Result<void> check_numbers(const data::DatasetInfo& info,
                           const std::vector<data::Coarsening>& chain, const Options& options,
                           const Open& open, const std::filesystem::path& store,
                           const CancelToken& cancel, const ShowDone& progress);

}  // namespace windsplat::convert
