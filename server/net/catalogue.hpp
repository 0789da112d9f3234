// The datasets as the edge sees them: by id, described, and views checked against them.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/store.hpp"

namespace windsplat::net {

// Thread-safe.
class Catalogue {
 public:
  explicit Catalogue(std::shared_ptr<data::Store> store) : store_(std::move(store)) {}

  [[nodiscard]] Result<std::shared_ptr<data::Dataset>> find(const std::string& id) const;

  // Every dataset, with ranges where they are known. Loads nothing.
  [[nodiscard]] Result<std::vector<protocol::DatasetDescription>> list() const;

  // The long form. Loads the fields of the first step, once: not for the io thread.
  Result<protocol::DatasetDescription> describe(const std::string& id);

  // Whether the view can be drawn, without loading anything; the value is the number of steps of
  // its dataset. Errors: not_found (dataset), invalid (with a pointer).
  [[nodiscard]] Result<int> check(const protocol::View& view) const;

 private:
  std::shared_ptr<data::Store> store_;
  mutable std::mutex mutex_;
  std::map<std::string, protocol::DatasetDescription> described_;
};

}  // namespace windsplat::net
