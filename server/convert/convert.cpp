#include "server/convert/convert.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "server/base/disk_error.hpp"
#include "server/base/whole_file.hpp"
#include "server/convert/checksums.hpp"
#include "server/convert/finish.hpp"
#include "server/convert/journal.hpp"
#include "server/convert/memory.hpp"
#include "server/convert/plan.hpp"
#include "server/convert/unit.hpp"
#include "server/convert/workers.hpp"

namespace windsplat::convert {

namespace {

namespace fs = std::filesystem;

Error failed(const char* what, const fs::path& path, int fault) {
  return disk_error(fault, std::string(what) + ' ' + in_quotes(path.native()));
}

bool is_there(const fs::path& path) {
  std::error_code fault;
  return fs::symlink_status(path, fault).type() != fs::file_type::not_found;
}

bool is_zarr(const fs::path& path) {
  std::error_code fault;
  return fs::is_regular_file(path / "zarr.json", fault) ||
         fs::is_regular_file(path / ".zgroup", fault);
}

Result<void> check_output(const fs::path& output, bool force) {
  if (!is_there(output)) return {};
  if (!force) {
    return make_error(ErrorKind::conflict,
                      in_quotes(output.native()) + " exists; --force replaces it");
  }
  if (is_zarr(output)) return {};
  return make_error(ErrorKind::conflict, in_quotes(output.native()) +
                                             " exists and is not a Zarr store: it is not replaced");
}

// The folder of an unfinished store, which is new, empty or has a journal.
Result<void> prepare(const fs::path& part) {
  std::error_code fault;
  if (is_there(part) && !is_there(journal_path(part)) && !fs::is_empty(part, fault)) {
    return make_error(ErrorKind::conflict,
                      in_quotes(part.native()) +
                          " exists and was not left by an unfinished conversion: remove it");
  }
  if (!fault) fs::create_directories(part, fault);
  if (fault) return failed("cannot make", part, fault.value());
  return {};
}

// What only an unfinished store needs; the journal last.
void clean(const fs::path& store) {
  std::error_code ignored;
  fs::remove_all(store / ".coarse", ignored);
  fs::remove(journal_path(store), ignored);
}

// Exchanges the names of two folders, or gives one the name of the other, which is not there.
int rename_to(const fs::path& part, const fs::path& output, bool exchanges) {
  const unsigned how = exchanges ? RENAME_EXCHANGE : RENAME_NOREPLACE;
  if (::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, output.c_str(), how) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
  // The file system has neither.
  const fs::path old = part.native() + ".old";
  if (exchanges && ::rename(output.c_str(), old.c_str()) != 0) return errno;
  if (::rename(part.c_str(), output.c_str()) != 0) {
    const int failure = errno;
    if (exchanges) ::rename(old.c_str(), output.c_str());
    return failure;
  }
  return exchanges && ::rename(old.c_str(), part.c_str()) != 0 ? errno : 0;
}

// Gives the store its name; the old one is removed. What has that name is looked at again, since
// it may not be what was there when the run began.
Result<void> put_in_place(const fs::path& part, const fs::path& output, bool force) {
  const int folder = ::open(part.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = folder >= 0 && ::syncfs(folder) == 0;
  const int fault = errno;
  if (folder >= 0) ::close(folder);
  if (!synced) return failed("cannot sync", part, fault);
  if (auto free = check_output(output, force); !free) {
    return make_error(free.error().kind, free.error().message + "; the new store is complete in " +
                                             in_quotes(part.native()) +
                                             ", and the same command renames it");
  }
  const bool replaces = is_there(output);
  if (const int failure = rename_to(part, output, replaces); failure != 0) {
    return failed("cannot rename the store to", output, failure);
  }
  std::error_code ignored;
  if (replaces) fs::remove_all(part, ignored);
  clean(output);
  const fs::path parent = output.has_parent_path() ? output.parent_path() : fs::path(".");
  return sync_folder(parent);
}

// Whether a run was ended after it had renamed the store, which is complete then: ends its work.
Result<bool> is_renamed(const fs::path& output, const fs::path& part, const Plan& plan,
                        bool force) {
  if (!is_there(journal_path(output)) || !is_zarr(output)) return false;
  if (auto free = Journal::check_free(output); !free) return free.error();
  if (!Journal::open(output, plan, false)) return false;  // of another plan
  std::error_code ignored;
  const bool has_replaced = force && is_zarr(part) && !is_there(journal_path(part));
  if (has_replaced) fs::remove_all(part, ignored);
  clean(output);
  return true;
}

std::string times_text(double times) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f", times);
  return text;
}

}  // namespace

Result<fs::path> plain_path(const fs::path& folder) {
  std::string text = folder.native();
  while (text.size() > 1 && text.back() == '/') text.pop_back();
  const fs::path out(text);
  const fs::path name = out.filename();
  if (!name.empty() && name != "." && name != "..") return out;
  return make_error(ErrorKind::invalid,
                    in_quotes(folder.native()) + " ends in no name of a folder");
}

Result<Report> convert(const data::DatasetInfo& info, const std::vector<data::Coarsening>& chain,
                       const Options& options, const Open& open, const fs::path& folder,
                       const CancelToken& cancel, const ShowDone& progress) {
  constexpr double decoded_often = 4;
  const auto plain = plain_path(folder);
  if (!plain) return plain.error();
  const fs::path& output = *plain;
  const fs::path part = output.native() + ".part";
  auto plan = make_plan(info, chain, options);
  if (!plan) return plan.error();
  if (auto readable = check_metadata(info, *plan); !readable) return readable.error();
  const auto shares = share_memory(info, *plan, options);
  if (!shares) return shares.error();
  Report report;
  const auto renamed = is_renamed(output, part, *plan, options.force);
  if (!renamed) return renamed.error();
  if (*renamed) {
    report.units_kept = plan->units.size();
    return report;
  }
  if (auto free = check_output(output, options.force); !free) return free.error();
  if (auto done = prepare(part); !done) return done.error();
  auto journal = Journal::open(part, *plan, options.restart);
  if (!journal) return journal.error();
  if (::mkdir((part / ".coarse").c_str(), 0777) != 0 && errno != EEXIST) {
    return failed("cannot make a folder in", part, errno);
  }

  const auto known = (*journal)->done();
  Task task;
  task.take = [&](std::size_t unit, UnitFiles files) {
    return (*journal)->add(unit, std::move(files));
  };
  for (std::size_t unit = 0; unit < plan->units.size(); ++unit) {
    if (!known.contains(unit)) task.units.push_back(unit);
  }
  report.workers = shares->workers;
  report.units_done = task.units.size();
  report.units_kept = known.size();
  report.notes = plan->notes;
  if (shares->decoded >= decoded_often) {
    report.notes.push_back("the chunks of " + in_quotes(shares->decoded_field) + " are decoded " +
                           times_text(shares->decoded) +
                           " times, as they are larger than what the memory limit lets be read "
                           "at once");
  }
  const auto read_bytes = make_units(info, *plan, *shares, open, part, task, cancel, progress);
  if (!read_bytes) {
    Error error = read_bytes.error();
    error.message += "; what is done is kept in " + in_quotes(part.native()) +
                     ", and the same command continues it";
    return error;
  }
  report.read_bytes = *read_bytes;
  const auto bytes = finish(info, *plan, part, (*journal)->done(), cancel);
  if (!bytes) return bytes.error();
  report.written_bytes = *bytes;
  if (auto done = put_in_place(part, output, options.force); !done) return done.error();
  return report;
}

}  // namespace windsplat::convert
