// The journal of a conversion: which units are complete, so that a later run continues.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "server/base/error.hpp"
#include "server/convert/plan.hpp"
#include "server/convert/unit.hpp"

namespace windsplat::convert {

// A file with a line of JSON for each unit, after one with the identity of the plan. Every line
// begins with the CRC-32C of the rest, so that one which was cut off is not taken for whole.
// Thread-safe.
class Journal {
 public:
  // Opens that of a store, or begins one; `anew`: discards what there is. Units whose files are
  // absent or have another size are not taken as done. Errors: conflict (another run holds it; it
  // is of another plan: the message names the difference), internal, out_of_memory.
  static Result<std::unique_ptr<Journal>> open(const std::filesystem::path& store, const Plan& plan,
                                               bool anew);
  // Errors: conflict, while another run holds that of a store.
  static Result<void> check_free(const std::filesystem::path& store);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  // Appends a unit and syncs. Errors: those of writing.
  Result<void> add(std::size_t unit, UnitFiles files);
  // By unit: those that are complete.
  [[nodiscard]] std::map<std::size_t, UnitFiles> done() const;

 private:
  Journal() = default;
  Result<void> hold(const std::filesystem::path& store);
  Result<void> discard(const std::filesystem::path& store);
  Result<void> load(const std::filesystem::path& store, const Plan& plan);
  Result<void> append(const data::zarr::OrderedJson& line);

  std::filesystem::path path_;
  int descriptor_ = -1;
  mutable std::mutex mutex_;
  std::map<std::size_t, UnitFiles> done_;
};

std::filesystem::path journal_path(const std::filesystem::path& store);

}  // namespace windsplat::convert
