// windsplat load: what the program starts by itself to read files apart (server/data/loader).
#include "server/cli/command.hpp"
#include "server/data/loader/loader.hpp"

namespace windsplat::cli {

int load() { return data::loader::run(); }

}  // namespace windsplat::cli
