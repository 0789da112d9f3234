// Names of files of a location -> URLs below its folder.
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "server/data/fetch/fetcher.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data::fetch {

namespace {

class FetchedFiles final : public Files {
 public:
  FetchedFiles(Fetcher& fetcher, Location location, Cancelled cancelled)
      : fetcher_(fetcher), location_(std::move(location)), cancelled_(std::move(cancelled)) {}
  [[nodiscard]] const Location& location() const override { return location_; }

  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    const auto url = url_of(name);
    if (!url) return url.error();
    auto descriptor = fetcher_.fetch(*url, cancelled_);
    if (!descriptor) return descriptor.error();
    auto file = InputFile::adopt(descriptor->give(), name.substr(name.find_last_of('/') + 1));
    if (file) count_opened(name, (*file)->size());
    return file;
  }

  Result<std::vector<std::string>> list(const std::string& folder) override {
    if (location_.kind != Location::Kind::folder) return not_permitted(folder);
    if (folder.empty()) return fetcher_.list(location_.folder, cancelled_);
    const auto url = url_of(folder);
    if (!url) return url.error();
    return fetcher_.list(*url, cancelled_);
  }

  // Fetches it, since most files that exist are opened next. Folders exist by their files only.
  bool exists(const std::string& name) override {
    if (location_.kind == Location::Kind::folder && name.ends_with('/')) return true;
    const auto file = open(name);
    if (!file && file.error().kind != ErrorKind::not_found && !fault_) fault_ = file.error();
    return file.has_value();
  }

  [[nodiscard]] std::optional<Error> take_fault() override { return std::exchange(fault_, {}); }

 private:
  static Error not_permitted(const std::string& name) {
    return make_error(ErrorKind::not_found, in_quotes(name) + " is not a file of this dataset");
  }

  [[nodiscard]] Result<std::string> url_of(const std::string& name) const {
    const auto member =
        std::find_if(location_.members.begin(), location_.members.end(),
                     [&](const Location::Member& known) { return known.name == name; });
    if (member != location_.members.end()) return member->path;
    if (!location_.companions && location_.kind != Location::Kind::folder) {
      return not_permitted(name);
    }
    if (name.empty() || name.front() == '/' || name.find('\0') != std::string::npos) {
      return not_permitted(name);
    }
    for (const auto& part : std::filesystem::path(name)) {
      if (part.empty() || part == "." || part == "..") return not_permitted(name);
    }
    return location_.folder + '/' + percent_encoded(name);
  }

  Fetcher& fetcher_;
  Location location_;
  Cancelled cancelled_;
  std::optional<Error> fault_;
};

}  // namespace

std::shared_ptr<Files> fetched_files(Fetcher& fetcher, Location location, Cancelled cancelled) {
  return std::make_shared<FetchedFiles>(fetcher, std::move(location), std::move(cancelled));
}

}  // namespace windsplat::data::fetch
