// Items of a figure -> a Cairo context, in its user space.
#pragma once

#include <cairo/cairo.h>

#include <vector>

#include "server/annotate/figure.hpp"

namespace windsplat::annotate {

void paint(const std::vector<Item>& items, cairo_t* target);

}  // namespace windsplat::annotate
