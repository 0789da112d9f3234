// Reads files in a separate, sandboxed process: Location -> RemoteSource in the daemon, run() in
// the loader. The loader returns the info in a message, which is validated, and numbers in shared
// memory.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/resident/budget.hpp"

namespace windsplat::data::loader {

// Limits of one loader. Volumes do not count towards its memory, because the caller provides them.
// A call that exceeds a limit fails with the reason; the loader is killed, and the next call starts
// another.
struct Limits {
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;
  // true: reads may use all of that memory; false: only as much as opening (opening_memory_bytes())
  bool reads_take_all = true;
  // Wall clock limits on a whole call.
  std::chrono::milliseconds open_time{60'000};
  std::chrono::milliseconds read_time{60'000};  // additional time:
  std::uint64_t read_bytes_per_second = 10'000'000;
  // A loader that sends no message and uses no processor time for this long has stalled, for
  // example on a disk that does not respond.
  std::chrono::milliseconds stall_time{15'000};
  // Budget for its private memory and that of the transfer; null: not counted.
  std::shared_ptr<Budget> budget = nullptr;
  std::size_t opens_max = 400'000;  // files opened in answer to one call
  // The files of a location; they ask `cancelled` whether to give up. Empty: direct_files().
  std::function<std::shared_ptr<Files>(const Location&, std::function<bool()> cancelled)> files{};
  std::function<bool()> cancelled{};  // set by RemoteSource
  // Additional time of a call for files that are fetched.
  std::chrono::milliseconds fetch_time{0};
  // Absolute folders of library tables, whose files may also be read.
  std::vector<std::string> library_folders{"/usr/share/eccodes/definitions", "/usr/share/proj"};
};

// Sets the executable of loaders, run as `program load`; call it once, before the first loader is
// started. There is no default, so that a program without that command never starts itself.
void set_program(std::string path);
// The executable of loaders for cases of OpenFOAM and EnSight (server/vtk_loader), likewise.
// Without one, or if it is not there, the other program refuses them.
void set_case_program(std::string path);
// Whether it is there and may be executed.
bool has_case_program();

// A dataset whose files are read by a loader. The loader is started on demand, and restarted by the
// next call after it was released or ended. Not thread-safe, except for cancel().
class RemoteSource : public Source {
 public:
  ~RemoteSource() override;
  [[nodiscard]] const DatasetInfo& info() const override;

  // Errors: those of readers; bad_data also if the loader crashed, exceeded its time limit or sent
  // an invalid message, or if the files changed since opening; out_of_memory if the limit leaves
  // too little for the loader; cancelled.
  Result<Volume> read(std::size_t field, std::size_t step) override;
  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override;

  // Called during reads, on the reading thread, about every 50 ms.
  void on_progress(Progress progress) override;

  // Cancels the running read, from any thread; later reads are unaffected.
  void cancel() override;

  [[nodiscard]] std::vector<Companion> companions() const override;

  // Ends the loader and closes all its files. The next read starts another.
  void release() override;

  // Process id of the current loader; -1 if there is none.
  [[nodiscard]] pid_t process() const;

 private:
  friend Result<std::unique_ptr<RemoteSource>> open(Location location, Limits limits,
                                                    const CancelToken& cancel);
  struct State;
  explicit RemoteSource(std::unique_ptr<State> state);
  template <class Read>
  Result<Volume> run(std::size_t field, std::size_t step, const Read& read);
  std::unique_ptr<State> state_;
};

// `cancel` ends the opening, and what is fetched for it. Errors: those of open_dataset(), and those
// of RemoteSource::read().
Result<std::unique_ptr<RemoteSource>> open(Location location, Limits limits = {},
                                           const CancelToken& cancel = {});

// Entry point of `windsplat load`. Returns the exit code, once the daemon closes the socket.
int run();

}  // namespace windsplat::data::loader
