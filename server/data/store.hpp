// The resident store: every dataset opened once, every field and step loaded once on first need,
// shared by all sessions, the least recently used evicted beyond the memory limit.
#pragma once

#include <any>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/coarsen.hpp"
#include "server/data/dataset.hpp"

namespace windsplat::data {

class Budget;  // the bytes that datasets share, with the volumes they pay for

// One opened dataset. Thread-safe.
class Dataset {
 public:
  Dataset(std::unique_ptr<Source> source, std::string id, std::uint64_t bytes_max);
  // Shares the budget of a store's other datasets.
  Dataset(std::unique_ptr<Source> source, std::string id, std::shared_ptr<Budget> budget);
  ~Dataset();

  [[nodiscard]] const DatasetInfo& info() const;

  // The field at the step; loads it if it is not resident. What a caller holds stays valid.
  // Errors: not_found (no such field or step), bad_data, out_of_memory.
  Result<std::shared_ptr<const Volume>> volume(const std::string& field, std::size_t step);

  // The field at the step, coarser: averaged once on first need, shared and counted in the memory
  // limit like the volume itself, which need not stay resident for it. One that asks while another
  // averages waits for it. Nothing halved: the volume itself. Errors: those of volume();
  // out_of_memory also where there is room for the volume but not for its level beside it.
  Result<std::shared_ptr<const Volume>> level(const std::string& field, std::size_t step,
                                              const Coarsening& how);

  // What a caller derived from this dataset and would be slow to derive again: one value, replaced
  // by the next. Empty unless it was kept under this key.
  [[nodiscard]] std::any kept(const std::string& key) const;
  void keep(std::string key, std::any value);

  [[nodiscard]] std::uint64_t resident_bytes() const;
  [[nodiscard]] std::uint64_t loads() const;     // how many volumes were ever read from the source
  [[nodiscard]] std::uint64_t averages() const;  // how many levels were ever averaged

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// All datasets of a process. Thread-safe.
class Store {
 public:
  explicit Store(std::uint64_t bytes_max);
  ~Store();

  // Opens and registers; the id is the sample's name or the file's name without its extension,
  // made unique by -2, -3. A sample is named by its bare name or with a size of its own (see
  // sized_sample), a file by its path.
  Result<std::shared_ptr<Dataset>> add(const std::string& sample_or_path);
  [[nodiscard]] Result<std::shared_ptr<Dataset>> find(const std::string& id) const;
  [[nodiscard]] std::vector<std::shared_ptr<Dataset>> all() const;  // in the order they were added

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::data
