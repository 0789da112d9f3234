// /proc, uname and the compiler -> Machine.
#include "server/study/machine.hpp"

#include <sys/utsname.h>

#include <fstream>
#include <iterator>
#include <thread>

#include "server/engine/kernels/dispatch.hpp"
#include "server/study/points_file.hpp"

namespace windsplat::study {

namespace {

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) {
      return printable(line.substr(colon + 2));
    }
  }
  return "unknown";
}

}  // namespace

Result<Machine> this_machine(unsigned threads) {
  Machine machine;
  machine.processor = processor();
  utsname names{};
  if (uname(&names) == 0) {
    machine.system = names.sysname;
    machine.system += ' ';
    machine.system += names.release;
    machine.system += ' ';
    machine.system += names.machine;
  }
#ifdef __clang__
  machine.compiler = __VERSION__;  // includes the name
#else
  machine.compiler = "g++ " __VERSION__;
#endif
  machine.version = WINDSPLAT_VERSION;
  std::ifstream in("/proc/self/exe", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (bytes.empty()) {
    return make_error(ErrorKind::internal, "cannot read the running program, /proc/self/exe");
  }
  machine.program = key_of(bytes);
  if (const auto table = engine::kernels::chosen_table()) machine.kernels = (*table)->name;
  machine.hardware_threads = std::thread::hardware_concurrency();
  machine.threads = threads;
  return machine;
}

}  // namespace windsplat::study
