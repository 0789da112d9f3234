#include "server/convert/verify.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/base/disk_error.hpp"
#include "server/convert/checksums.hpp"
#include "server/convert/finish.hpp"
#include "server/convert/memory.hpp"
#include "server/convert/plan.hpp"
#include "server/convert/workers.hpp"
#include "server/data/formats/zarr/json.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::convert {

namespace {

namespace fs = std::filesystem;

Error unsound(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

Result<std::string> text_of_file(const fs::path& path) {
  constexpr std::uintmax_t bytes_max = std::uintmax_t{1} << 28;
  std::error_code fault;
  const auto bytes = fs::file_size(path, fault);
  std::ifstream file(path, std::ios::binary);
  if (fault || !file || bytes > bytes_max) {
    return make_error(ErrorKind::not_found, "cannot read " + in_quotes(path.native()));
  }
  return std::string(std::istreambuf_iterator<char>(file), {});
}

bool is_of_root(const std::string& path) { return path.find('/') == std::string::npos; }

// Names of files that hold no numbers.
bool is_metadata(const std::string& path) {
  const std::string name = path.substr(path.rfind('/') + 1);
  return name == "zarr.json" || name.starts_with(".z");
}

// The list of a store, and its digest.
struct Listed {
  Checksums checksums;
  std::string digest;
  std::uint64_t bytes = 0;
};

Result<Listed> listed(const fs::path& store) {
  auto text = text_of_file(store / checksums_name);
  if (!text) {
    return make_error(ErrorKind::not_found, in_quotes(store.native()) +
                                                " is no store of windsplat convert: it has no " +
                                                checksums_name);
  }
  auto checksums = parse_checksums(*text);
  if (!checksums) return checksums.error();
  Listed out{std::move(*checksums), data::digest_of(*text), text->size()};
  for (const auto& [path, sum] : out.checksums) out.bytes += sum.bytes;
  return out;
}

// The attribute of the root.
Result<data::zarr::Json> attribute_of(const fs::path& store) {
  const bool is_v3 = fs::exists(store / "zarr.json");
  const auto text = text_of_file(store / (is_v3 ? "zarr.json" : ".zattrs"));
  if (!text) return text.error();
  const auto json = data::zarr::parse_json(*text);
  if (!json) return json.error();
  const auto* attributes = is_v3 ? json->find("attributes") : &*json;
  const auto* own = attributes == nullptr ? nullptr : attributes->find("windsplat");
  if (own == nullptr) return unsound("the store has no attribute windsplat");
  return *own;
}

Result<Recorded> recorded(const fs::path& store, const std::string& digest) {
  const auto own = attribute_of(store);
  if (!own) return own.error();
  if (own->text_at("contents") != digest) {
    return unsound(std::string(checksums_name) + " is not that of the store: its digest is not " +
                   "the `contents` of the metadata");
  }
  Recorded out;
  const auto* made = own->find("made");
  const auto* fields = made == nullptr ? nullptr : made->find("fields");
  const auto* steps = made == nullptr ? nullptr : made->find("steps");
  if (fields == nullptr || steps == nullptr) {
    return unsound("the attribute windsplat lacks how the store was made");
  }
  for (const auto& field : fields->list) out.fields.push_back(field.text);
  for (const auto& step : steps->list) {
    out.steps.push_back(static_cast<std::size_t>(std::max<std::int64_t>(step.integer, 0)));
  }
  out.compression = made->text_at("compression");
  out.zarr = fs::exists(store / "zarr.json") ? 3 : 2;
  out.program = own->text_at("program");
  out.same_program = out.program == "windsplat " WINDSPLAT_VERSION;
  return out;
}

// Of the store made anew.
class Anew {
 public:
  Anew(const data::DatasetInfo& info, const std::vector<data::Coarsening>& chain,
       const Options& options, const Open& open, const fs::path& store)
      : info_(info), chain_(chain), options_(options), open_(open), store_(store) {}
  ~Anew() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  Anew(const Anew&) = delete;
  Anew& operator=(const Anew&) = delete;

  Result<void> compare(const CancelToken& cancel, const ShowDone& progress) {
    auto list = listed(store_);
    if (!list) return list.error();
    expected_ = std::move(list->checksums);
    const auto plan = make_plan(info_, chain_, options_);
    if (!plan) return plan.error();
    const auto shares = share_memory(info_, *plan, options_);
    if (!shares) return shares.error();
    if (auto made = make_folder(); !made) return made;
    std::map<std::size_t, UnitFiles> units;
    std::mutex mutex;
    Task task;
    for (std::size_t n = 0; n < plan->units.size(); ++n) task.units.push_back(n);
    task.take = [&](std::size_t unit, UnitFiles files) -> Result<void> {
      const std::lock_guard lock(mutex);
      for (const auto& file : files.files) {
        if (auto same = check(file.path, {file.bytes, file.crc32c}); !same) return same;
        std::error_code ignored;
        fs::remove(folder_ / file.path, ignored);
      }
      units.emplace(unit, std::move(files));
      return {};
    };
    const auto made = make_units(info_, *plan, *shares, open_, folder_, task, cancel, progress);
    if (!made) return made.error();
    if (auto done = finish(info_, *plan, folder_, units, cancel); !done) return done.error();
    return compare_rest();
  }

 private:
  // Of this run alone, beside the store.
  Result<void> make_folder() {
    const auto plain = plain_path(store_);
    if (!plain) return plain.error();
    std::string name = plain->native() + ".verify.XXXXXX";
    const bool made = ::mkdtemp(name.data()) != nullptr;
    if (made) folder_ = name;
    if (!made || ::mkdir((folder_ / ".coarse").c_str(), 0777) != 0) {
      return disk_error(errno, "cannot make the folder " + in_quotes(name));
    }
    return {};
  }

  Result<void> check(const std::string& path, const Checksum& sum) const {
    const auto found = expected_.find(path);
    if (found != expected_.end() && found->second == sum) return {};
    return unsound(in_quotes(path) + (found == expected_.end() ? " is missing" : " differs") +
                   " from what is made of " + in_quotes(info_.source));
  }

  // Files that are made at the end, and those that are not made.
  Result<void> compare_rest() const {
    const auto list = listed(folder_);
    if (!list) return list.error();
    for (const auto& [path, sum] : list->checksums) {
      if (is_metadata(path)) continue;
      if (auto same = check(path, sum); !same) return same;
    }
    for (const auto& [path, sum] : expected_) {
      if (!is_metadata(path) && !list->checksums.contains(path)) {
        return unsound(in_quotes(path) + " holds numbers that are not made of " +
                       in_quotes(info_.source));
      }
    }
    return {};
  }

  const data::DatasetInfo& info_;
  const std::vector<data::Coarsening>& chain_;
  const Options& options_;
  const Open& open_;
  const fs::path& store_;
  fs::path folder_;  // empty: not made
  Checksums expected_;
};

Result<void> check_file(const fs::path& store, const std::string& path, const Checksum& sum,
                        const std::string& digest, const CancelToken& cancel) {
  Result<Checksum> found = make_error(ErrorKind::not_found, "");
  if (is_of_root(path)) {
    const auto text = text_of_file(store / path);
    if (text) found = checksum_of(without_contents(*text, digest));
  } else {
    found = checksum_of_file(store / path, cancel);
  }
  if (!found) {
    if (found.error().kind == ErrorKind::cancelled) return found.error();
    return unsound(in_quotes(path) + " of the store cannot be read");
  }
  if (*found == sum) return {};
  return unsound(in_quotes(path) + " of the store was changed: " +
                 (found->bytes == sum.bytes ? "its checksum differs"
                                            : std::to_string(found->bytes) + " bytes in place of " +
                                                  std::to_string(sum.bytes)));
}

}  // namespace

Result<Recorded> check_files(const fs::path& store, const CancelToken& cancel,
                             const ShowDone& progress) {
  const auto list = listed(store);
  if (!list) return list.error();
  std::uint64_t done = 0;
  for (const auto& [path, sum] : list->checksums) {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "interrupted");
    if (auto same = check_file(store, path, sum, list->digest, cancel); !same) return same.error();
    done += sum.bytes;
    progress(static_cast<double>(done) / static_cast<double>(list->bytes));
  }
  std::error_code fault;
  for (auto at = fs::recursive_directory_iterator(store, fault);
       !fault && at != fs::recursive_directory_iterator(); at.increment(fault)) {
    if (!at->is_regular_file(fault)) continue;
    const std::string path = at->path().lexically_relative(store).generic_string();
    if (path != checksums_name && !list->checksums.contains(path)) {
      return unsound(in_quotes(path) + " does not belong to the store");
    }
  }
  auto out = recorded(store, list->digest);
  if (!out) return out;
  out->files = list->checksums.size();
  out->bytes = list->bytes;
  return out;
}

Result<void> check_numbers(const data::DatasetInfo& info,
                           const std::vector<data::Coarsening>& chain, const Options& options,
                           const Open& open, const fs::path& store, const CancelToken& cancel,
                           const ShowDone& progress) {
  return Anew(info, chain, options, open, store).compare(cancel, progress);
}

}  // namespace windsplat::convert
