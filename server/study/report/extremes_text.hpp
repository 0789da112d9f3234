// Results of the extreme cases -> CSV and text for a terminal.
#pragma once

#include <string>

#include "server/study/extremes/extremes.hpp"

namespace windsplat::study {

std::string extremes_csv(const Extremes& extremes);  // one line per case

// Where each method may be trusted, the cases that failed, and the reasons of refusals.
std::string extremes_text(const Extremes& extremes);

}  // namespace windsplat::study
