#include "server/convert/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/disk_error.hpp"
#include "server/data/formats/zarr/crc32c.hpp"

namespace windsplat::convert {

namespace {

using data::zarr::OrderedJson;
namespace fs = std::filesystem;

constexpr std::size_t crc_digits = 8;

std::uint32_t crc_of(std::string_view text) {
  return data::zarr::crc32c(reinterpret_cast<const unsigned char*>(text.data()), text.size());
}

std::string line_of(const OrderedJson& json) {
  const std::string text = json.dump();
  char crc[crc_digits + 2];
  std::snprintf(crc, sizeof crc, "%08x ", crc_of(text));
  return crc + text + '\n';
}

// The JSON of a line without its end; nullopt if it is damaged.
std::optional<OrderedJson> parse_line(std::string_view line) {
  std::uint32_t crc = 0;
  if (line.size() <= crc_digits) return std::nullopt;
  const auto [end, fault] = std::from_chars(line.data(), line.data() + crc_digits, crc, 16);
  if (fault != std::errc() || end != line.data() + crc_digits) return std::nullopt;
  const std::string_view text = line.substr(crc_digits + 1);
  if (crc_of(text) != crc) return std::nullopt;
  auto json = OrderedJson::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return std::nullopt;
  return json;
}

OrderedJson json_of(std::size_t unit, const UnitFiles& files) {
  OrderedJson list = OrderedJson::array();
  for (const auto& file : files.files) {
    list.push_back(OrderedJson::array({file.path, file.bytes, file.crc32c}));
  }
  return {{"unit", unit}, {"files", std::move(list)}, {"kept", files.kept_bytes}};
}

bool has_size(const fs::path& path, std::uint64_t bytes) {
  std::error_code fault;
  return fs::file_size(path, fault) == bytes && !fault;
}

// The unit of a line; nullopt if files are not there.
std::optional<std::pair<std::size_t, UnitFiles>> unit_of(const OrderedJson& json,
                                                         const fs::path& store) {
  std::pair<std::size_t, UnitFiles> out;
  out.first = json.at("unit").get<std::size_t>();
  out.second.kept_bytes = json.at("kept").get<std::size_t>();
  if (!has_size(kept_path(store, out.first), out.second.kept_bytes)) return std::nullopt;
  for (const auto& file : json.at("files")) {
    data::zarr::WrittenFile one{file.at(0).get<std::string>(), file.at(1).get<std::uint64_t>(),
                                file.at(2).get<std::uint32_t>()};
    if (!has_size(store / one.path, one.bytes)) return std::nullopt;
    out.second.files.push_back(std::move(one));
  }
  return out;
}

// The first member that two identities do not have in common.
std::string difference(const OrderedJson& begun, const OrderedJson& now) {
  for (const auto& [name, value] : now.items()) {
    const auto other = begun.find(name);
    const std::string before = other == begun.end() ? "nothing" : other->dump();
    if (before != value.dump()) {
      return name + ": " + printable(before) + ", now " + printable(value.dump());
    }
  }
  return "its description";
}

}  // namespace

fs::path journal_path(const fs::path& store) { return store / ".journal"; }

Result<std::unique_ptr<Journal>> Journal::open(const fs::path& store, const Plan& plan, bool anew) {
  std::unique_ptr<Journal> out(new Journal());
  if (auto held = out->hold(store); !held) return held.error();
  if (anew) {
    if (auto done = out->discard(store); !done) return done.error();
  }
  if (auto done = out->load(store, plan); !done) return done.error();
  return out;
}

Journal::~Journal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<void> Journal::check_free(const fs::path& store) { return Journal().hold(store); }

Result<void> Journal::hold(const fs::path& store) {
  path_ = journal_path(store);
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) return disk_error(errno, "cannot open " + in_quotes(path_.native()));
  // The run that held it may have renamed the store and removed the file before it was locked.
  struct stat held {};
  struct stat named {};
  const bool is_held = ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 &&
                       ::fstat(descriptor_, &held) == 0 && ::stat(path_.c_str(), &named) == 0 &&
                       held.st_dev == named.st_dev && held.st_ino == named.st_ino;
  if (!is_held) {
    return make_error(ErrorKind::conflict,
                      in_quotes(store.native()) + " is being written by another run");
  }
  return {};
}

// The journal is held all the while, and stays.
Result<void> Journal::discard(const fs::path& store) {
  if (::ftruncate(descriptor_, 0) != 0) {
    return disk_error(errno, "cannot shorten " + in_quotes(path_.native()));
  }
  std::error_code fault;
  std::vector<fs::path> others;
  for (auto at = fs::directory_iterator(store, fault); !fault && at != fs::directory_iterator();
       at.increment(fault)) {
    if (at->path() != path_) others.push_back(at->path());
  }
  for (const fs::path& path : others) {
    if (!fault) fs::remove_all(path, fault);
  }
  if (fault) return disk_error(fault.value(), "cannot empty " + in_quotes(store.native()));
  return {};
}

Result<void> Journal::load(const fs::path& store, const Plan& plan) {
  std::ifstream file(path_, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  std::size_t whole = 0;  // bytes of whole lines
  bool first = true;
  while (true) {
    const std::size_t end = text.find('\n', whole);
    if (end == std::string::npos) break;
    const auto json = parse_line(std::string_view(text).substr(whole, end - whole));
    if (!json) break;
    if (first && *json != plan.identity) {
      return make_error(ErrorKind::conflict,
                        in_quotes(store.native()) + " was begun with other input or options (" +
                            difference(*json, plan.identity) + "); --restart discards it");
    }
    if (!first) {
      if (auto unit = unit_of(*json, store); unit && unit->first < plan.units.size()) {
        done_.insert_or_assign(unit->first, std::move(unit->second));
      }
    }
    first = false;
    whole = end + 1;
  }
  if (::ftruncate(descriptor_, static_cast<off_t>(whole)) != 0) {
    return disk_error(errno, "cannot shorten " + in_quotes(path_.native()));
  }
  return first ? append(plan.identity) : Result<void>();
}

Result<void> Journal::append(const OrderedJson& json) {
  const std::string line = line_of(json);
  const ssize_t wrote = ::write(descriptor_, line.data(), line.size());
  if (wrote != static_cast<ssize_t>(line.size()) || ::fdatasync(descriptor_) != 0) {
    return disk_error(wrote < 0 ? errno : ENOSPC, "cannot write " + in_quotes(path_.native()));
  }
  return {};
}

Result<void> Journal::add(std::size_t unit, UnitFiles files) {
  const std::lock_guard lock(mutex_);
  if (auto done = append(json_of(unit, files)); !done) return done;
  done_.insert_or_assign(unit, std::move(files));
  return {};
}

std::map<std::size_t, UnitFiles> Journal::done() const {
  const std::lock_guard lock(mutex_);
  return done_;
}

}  // namespace windsplat::convert
