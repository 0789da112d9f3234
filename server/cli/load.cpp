// windsplat load: internal command that reads files in a separate process (server/data/loader).
#include "server/cli/command.hpp"
#include "server/data/loader/loader.hpp"

namespace windsplat::cli {

int load() { return data::loader::run(); }

}  // namespace windsplat::cli
