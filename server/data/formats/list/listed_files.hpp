// The files that a list names: those of its location, with the group and the entries of the list.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/files/files.hpp"

namespace windsplat::data::list {

class ListedFiles final : public Files {
 public:
  ListedFiles(std::shared_ptr<Files> files, Location location)
      : files_(std::move(files)), location_(std::move(location)) {}

  [[nodiscard]] const Location& location() const override { return location_; }
  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    auto file = files_->open(name);
    if (file) count_opened(name, (*file)->size());
    return file;
  }
  Result<std::vector<std::string>> list(const std::string& folder) override {
    return files_->list(folder);
  }
  bool exists(const std::string& name) override { return files_->exists(name); }
  [[nodiscard]] std::vector<Companion> companions() const override { return files_->companions(); }

 private:
  std::shared_ptr<Files> files_;
  Location location_;
};

}  // namespace windsplat::data::list
