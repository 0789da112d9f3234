// A source of fields -> a Zarr store of bricks at several levels, in bounded memory, by units that
// are independent of each other (docs/design/bricks.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::convert {

struct Options {
  std::vector<std::string> fields;  // names, each once; empty: all that are stored
  std::vector<std::size_t> steps;   // ascending; empty: all
  std::string compression = "lz4";  // lz4, zstd, zstd:1 to zstd:9, none
  int zarr = 3;                     // version of the format, 2 or 3
  std::uint64_t memory_bytes = 0;   // of this process and its loaders
  std::function<std::string(std::uint64_t)>
      memory_text;       // how a limit is given: "--memory-limit 1G"
  unsigned threads = 1;  // at least 1
  bool force = false;    // replaces a store that exists
  bool restart = false;  // discards what an earlier run left unfinished
};

// Opens the input again, with so many bytes for the private memory of its loader; from any thread.
using Open = std::function<Result<std::unique_ptr<data::Source>>(std::uint64_t loader_bytes)>;

struct Report {
  std::uint64_t read_bytes = 0;     // of samples, by this run
  std::uint64_t written_bytes = 0;  // of all files of the store
  std::size_t units_done = 0;       // by this run
  std::size_t units_kept = 0;       // of an earlier run
  unsigned workers = 0;
  std::vector<std::string> notes;  // what is slower than it could be, or left out
};

// The part that is done, 0 to 1; from any thread.
using ShowDone = std::function<void(double done)>;

// Without '/' at the end. Errors: invalid, if it does not end in a name.
Result<std::filesystem::path> plain_path(const std::filesystem::path& folder);

// Writes OUTPUT.part and renames it once it is complete. What a run leaves is continued by the next
// with equal input and options, to the same bytes. `chain`: the levels, finest first: of full
// detail and of coarser ones, with the widths of the cells along every axis that is halved. Errors:
// invalid (fields, steps, compression; names that collide), conflict (the output exists; an
// unfinished one is of other input or options), out_of_memory (the limit; a full disk), cancelled,
// those of reading and writing.
Result<Report> convert(const data::DatasetInfo& info, const std::vector<data::Coarsening>& chain,
                       const Options& options, const Open& open,
                       const std::filesystem::path& folder, const CancelToken& cancel,
                       const ShowDone& progress);

}  // namespace windsplat::convert
