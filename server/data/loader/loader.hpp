// Files are read in a process apart that has given up everything else: Location -> RemoteSource
// here, run() there. Info comes back as a message that is checked, numbers in shared memory.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/resident/budget.hpp"

namespace windsplat::data::loader {

// What one loader may use. Its volumes do not count as its memory: they are the caller's. A call
// that exceeds a limit fails with the reason, its loader is killed, and the next call starts
// another.
struct Limits {
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;
  // Whether reads get that, or no more than opening does (opening_memory_bytes()).
  bool reads_take_all = true;
  // Of the wall clock, for a call as a whole.
  std::chrono::milliseconds open_time{60'000};
  std::chrono::milliseconds read_time{60'000};  // and beyond that:
  std::uint64_t read_bytes_per_second = 10'000'000;
  // A loader that sends nothing and uses no processor time for so long is stopped, or waits for a
  // disk that does not answer.
  std::chrono::milliseconds stall_time{15'000};
  // Where its private memory and that of the transfer count; null: nowhere.
  std::shared_ptr<Budget> budget = nullptr;
  std::size_t opens_max = 400'000;  // files opened in answer to one call
  // Where libraries keep tables of their own, absolute: their files may be read besides.
  std::vector<std::string> library_folders{"/usr/share/eccodes/definitions"};
};

// What loaders run, as `program load`: once, before the first is started. There is none until then,
// so that no program starts itself that does not know the command.
void set_program(std::string path);

// A dataset whose files a loader reads. The loader is there while it is needed, and started again
// for the next call after it was released or died. One thread at a time, but for cancel().
class RemoteSource : public Source {
 public:
  ~RemoteSource() override;
  [[nodiscard]] const DatasetInfo& info() const override;

  // Errors: those of readers; bad_data also where the loader died, took too long or sent what it
  // should not, and where the files are no longer those that were opened; out_of_memory where the
  // limit leaves too little for the loader; cancelled.
  Result<Volume> read(std::size_t field, std::size_t step) override;

  // Called during reads, on the thread that reads, every 50 ms or so.
  void on_progress(Progress progress) override;

  // Ends the read that is under way, from any thread; one that begins later is none of it.
  void cancel() override;

  [[nodiscard]] std::vector<Companion> companions() const override;

  // Ends the loader, and with it all open files. The next read starts another.
  void release() override;

  // The loader that is there now; -1 if there is none.
  [[nodiscard]] pid_t process() const;

 private:
  friend Result<std::unique_ptr<RemoteSource>> open(Location location, Limits limits);
  struct State;
  explicit RemoteSource(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// Errors: those of open_dataset(), and those of RemoteSource::read().
Result<std::unique_ptr<RemoteSource>> open(Location location, Limits limits = {});

// The other side: what `windsplat load` does. Returns the exit code, once the daemon closes the
// socket.
int run();

}  // namespace windsplat::data::loader
