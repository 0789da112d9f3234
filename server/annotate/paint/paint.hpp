// Items of a figure -> a Cairo context, in its user space.
#pragma once

#include <vector>

#include "server/annotate/figure.hpp"

struct _cairo;  // cairo_t

namespace windsplat::annotate {

void paint(const std::vector<Item>& items, _cairo* target);

}  // namespace windsplat::annotate
