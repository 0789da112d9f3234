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

// The same files, named relative to a folder ("sub/") among them: that of a header which names
// others.
class FilesBelow final : public Files {
 public:
  FilesBelow(std::shared_ptr<Files> files, std::string folder)
      : files_(std::move(files)), folder_(std::move(folder)) {}

  [[nodiscard]] const Location& location() const override { return files_->location(); }
  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    return files_->open(below(name));
  }
  Result<std::vector<std::string>> list(const std::string& folder) override {
    return files_->list(below(folder));
  }
  bool exists(const std::string& name) override { return files_->exists(below(name)); }
  [[nodiscard]] std::vector<Companion> companions() const override { return files_->companions(); }

 private:
  // Absolute names stay absolute and are refused.
  [[nodiscard]] std::string below(const std::string& name) const {
    return name.starts_with('/') ? name : folder_ + name;
  }

  std::shared_ptr<Files> files_;
  std::string folder_;
};

}  // namespace windsplat::data::list
