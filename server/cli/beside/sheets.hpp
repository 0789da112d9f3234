// Panels -> the file of one picture, or of two side by side.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/limited_picture.hpp"
#include "server/image/encode.hpp"

namespace windsplat::cli {

struct Sheet {
  image::Bytes bytes;  // of a raw encoding the pixels
  int width = 0;
  int height = 0;
  std::string reports;  // a line of JSON for each picture, from left to right
  // On each limit that a picture exceeds; why a picture shows nothing of the data. Empty: none.
  std::string exceeded;
  std::string coarser;  // coarser_level_of() each picture
  std::string empty;
  std::string empty_surfaces;  // why a picture that shows something lacks some of its surfaces
};

// Draws the pictures of a command one after another.
class Sheets {
 public:
  // Panels and pool must outlive this object; between two calls of draw() the panels may get other
  // steps and times. Errors: invalid for two panels as an array (npy).
  static Result<Sheets> of(std::vector<Panel>& panels, const frame::Encoding& encoding,
                           ThreadPool& pool);

  // `show` may be empty. Errors: those of LimitedPictures::draw() and frame::encode_pair().
  Result<Sheet> draw(const CancelToken& cancel, const ShowDone& show = {});

 private:
  Sheets(std::vector<Panel>& panels, const frame::Encoding& encoding)
      : panels_(&panels), encoding_(encoding) {}

  std::vector<Panel>* panels_;
  frame::Encoding encoding_;
  std::deque<LimitedPictures> pictures_;  // of each panel
};

}  // namespace windsplat::cli
