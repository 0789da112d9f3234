// Names of files of a location -> URLs below its folder.
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "server/data/fetch/ahead.hpp"
#include "server/data/fetch/fetcher.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data::fetch {

namespace {

class FetchedFiles final : public Files {
 public:
  FetchedFiles(Fetcher& fetcher, Location location, Cancelled cancelled)
      : fetcher_(fetcher),
        location_(std::move(location)),
        cancelled_(std::move(cancelled)),
        ahead_(fetcher) {}
  [[nodiscard]] const Location& location() const override { return location_; }

  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    // Files of a folder are small, or chunks that are read as a whole.
    const bool is_whole = location_.kind == Location::Kind::folder || location_.service;
    return open_as(name, is_whole ? Fetch::whole : Fetch::parts);
  }

  Result<std::shared_ptr<const InputFile>> open_parts(const std::string& name) override {
    return open_as(name, location_.service ? Fetch::whole : Fetch::parts);
  }

  void expect(const Expected& what) override {
    const auto url = url_of(what.name);
    if (!url || location_.service) return;
    const auto open = std::find_if(parts_.begin(), parts_.end(),
                                   [&](const auto& one) { return one.second.url == *url; });
    ahead_.expect(*url, open == parts_.end() ? nullptr : open->second.file, what);
  }

  void forget_expected() override { ahead_.forget(); }

  Result<Extent> fetch_part(std::uint64_t number, std::uint64_t offset,
                            std::uint64_t count) override {
    const auto at = parts_.find(number);
    if (at == parts_.end()) return make_error(ErrorKind::not_found, "no such file is open");
    // Libraries read on after a fault, and each request may take as long as the first.
    if (fault_) return *fault_;
    const Parts& of = at->second;
    auto out = fetcher_.fetch_part(of.url, *of.file, offset, count, cancelled_);
    if (!out && out.error().kind == ErrorKind::out_of_memory && ahead_.give_way()) {
      out = fetcher_.fetch_part(of.url, *of.file, offset, count, cancelled_);
    }
    if (out) ahead_.note_read(*of.file, *out);
    if (out) return out;
    fault_ = out.error();
    is_unfit_ = fetcher_.is_unfit(of.file->url());
    return out;
  }

  void close_parts(std::uint64_t number) override { parts_.erase(number); }

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
    if (file) close_parts((*file)->parts().number);
    if (!file && file.error().kind != ErrorKind::not_found && !fault_) fault_ = file.error();
    return file.has_value();
  }

  [[nodiscard]] std::optional<Error> take_fault() override { return std::exchange(fault_, {}); }
  [[nodiscard]] bool is_unfit_for_parts() const override { return is_unfit_; }

 private:
  struct Parts {
    std::string url;
    std::shared_ptr<SparseFile> file;
  };

  Result<std::shared_ptr<const InputFile>> open_as(const std::string& name, Fetch how) {
    if (fault_) return *fault_;  // as in fetch_part
    const auto url = url_of(name);
    if (!url) return url.error();
    auto known = ahead_.take(*url, cancelled_);
    auto fetched = known ? std::move(*known) : fetcher_.fetch(*url, how, cancelled_);
    if (!fetched) return fetched.error();
    FileParts parts{0, std::move(fetched->state)};
    if (fetched->parts) {
      if (parts_.size() >= location_.members.size() + open_besides_members_max) {
        return make_error(ErrorKind::bad_data, in_quotes(name) + ": too many files are open");
      }
      parts.number = ++last_number_;
      parts_[parts.number] = {*url, std::move(fetched->parts)};
    }
    auto file = InputFile::adopt(fetched->file.give(), name.substr(name.find_last_of('/') + 1),
                                 std::move(parts));
    if (file) count_opened(name, (*file)->size());
    return file;
  }

  static Error not_permitted(const std::string& name) {
    return make_error(ErrorKind::not_found, in_quotes(name) + " is not a file of this dataset");
  }

  [[nodiscard]] Result<std::string> url_of(const std::string& name) const {
    if (location_.service) return url_of_answer(name);
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

  // NAME.dds, NAME.das or NAME.dods?CONSTRAINT; constraints are percent-encoded as a whole.
  [[nodiscard]] Result<std::string> url_of_answer(std::string_view name) const {
    const Location::Member& dataset = location_.members.front();
    if (!name.starts_with(dataset.name)) return not_permitted(std::string(name));
    name.remove_prefix(dataset.name.size());
    if (name == ".dds" || name == ".das") return dataset.path + std::string(name);
    constexpr std::string_view values = ".dods?";
    if (!name.starts_with(values)) return not_permitted(std::string(name));
    return dataset.path + std::string(values) + percent_encoded(name.substr(values.size()));
  }

  Fetcher& fetcher_;
  Location location_;
  Cancelled cancelled_;
  std::optional<Error> fault_;
  bool is_unfit_ = false;
  std::map<std::uint64_t, Parts> parts_;  // by number
  std::uint64_t last_number_ = 0;
  Ahead ahead_;
};

}  // namespace

std::shared_ptr<Files> fetched_files(Fetcher& fetcher, Location location, Cancelled cancelled) {
  return std::make_shared<FetchedFiles>(fetcher, std::move(location), std::move(cancelled));
}

}  // namespace windsplat::data::fetch
