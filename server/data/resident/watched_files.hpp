// The files from which a dataset was opened, and whether they have changed since.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/data/files/files.hpp"
#include "server/data/files/stamp.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

// The combined state of the watched files of a dataset; always the same for one that is fetched,
// whose files are not watched.
FileStamp stamp_of_all(const Location& location, const std::vector<Companion>& companions);
// States at the time of opening: members from `before`, companions as recorded by the source.
std::string stamp_as_opened(FileStamp before, const std::vector<Companion>& companions);
// Matches a series again if its folder has changed. False: not necessary.
bool match_again(std::optional<Location>& location, std::string& listed);
// Same text: same files in the same state.
std::string key_of(const Location& location);

}  // namespace windsplat::data
