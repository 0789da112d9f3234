#include "server/cli/beside/sheets.hpp"

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

#include "server/frame/pair/pair.hpp"

namespace windsplat::cli {
namespace {

void add_text(const std::string& text, bool pair, std::size_t panel, std::string& out) {
  if (text.empty()) return;
  if (!out.empty()) out += "; ";
  if (pair) out += panel == 0 ? "left: " : "right: ";
  out += text;
}

}  // namespace

Result<Sheets> Sheets::of(std::vector<Panel>& panels, const frame::Encoding& encoding,
                          ThreadPool& pool) {
  Sheets out(panels, encoding);
  frame::Encoding each = encoding;
  if (panels.size() > 1) {
    const auto raw = frame::raw_of_pair(encoding);
    if (!raw) return raw.error();
    each = *raw;
  }
  for (Panel& panel : panels) out.pictures_.emplace_back(*panel.dataset, each, pool);
  return out;
}

Result<Sheet> Sheets::draw(const CancelToken& cancel, const ShowDone& show) {
  Sheet sheet;
  std::array<frame::Frame, 2> frames;
  const bool pair = panels_->size() > 1;
  for (std::size_t n = 0; n < panels_->size(); ++n) {
    ShowDone part;
    if (show) {
      part = [&show, n, all = panels_->size()](double done, std::string_view doing) {
        show((static_cast<double>(n) + done) / static_cast<double>(all), doing);
      };
    }
    auto picture = pictures_[n].draw((*panels_)[n].view, cancel, part);
    if (!picture) return picture.error();
    sheet.reports += report_line(*picture);
    add_text(exceeded_limits(*picture), pair, n, sheet.exceeded);
    add_text(coarser_level_of(*picture), pair, n, sheet.coarser);
    add_text(picture->frame.empty, pair, n, sheet.empty);
    std::string reasons;
    for (const std::string& reason : picture->empty_surfaces) {
      reasons += (reasons.empty() ? "" : "; ") + reason;
    }
    add_text(reasons, pair, n, sheet.empty_surfaces);
    frames.at(n) = std::move(picture->frame);
  }
  sheet.width = frames[0].width;
  sheet.height = frames[0].height;
  if (!pair) {
    sheet.bytes = std::move(frames[0].bytes);
    return sheet;
  }
  sheet.width += frames[1].width + frame::gap_of_pair(sheet.height);
  auto bytes = frame::encode_pair(frames, encoding_, cancel);
  if (!bytes) return bytes.error();
  sheet.bytes = std::move(*bytes);
  return sheet;
}

}  // namespace windsplat::cli
