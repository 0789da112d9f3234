#include "server/cli/beside/panels.hpp"

#include <array>
#include <string>
#include <utility>

#include "server/cli/beside/share.hpp"
#include "server/frame/frame.hpp"

namespace windsplat::cli {
namespace {

Error of_second(Error error) {
  error.message = "of the picture beside: " + error.message;
  return error;
}

// The view of the second picture, as asked for.
Result<protocol::View> second_view(const ViewArguments& arguments,
                                   const protocol::ViewDocument& first) {
  std::vector<std::pair<std::string, std::string>> changes;
  if (!arguments.beside_step.empty()) changes.emplace_back("/step", arguments.beside_step);
  bool names_dataset = false;
  for (const std::string& setting : arguments.beside_settings) {
    auto change = parse_setting("--beside-set", setting);
    if (!change) return change.error();
    names_dataset = names_dataset || change->first == "/dataset";
    changes.push_back(std::move(*change));
  }
  const auto document = protocol::set_all(first, changes);
  if (!document) return of_second(document.error());
  protocol::View view = document->view();
  const protocol::View one = first.view();
  if (names_dataset || view.dataset != one.dataset) {
    return make_error_at(ErrorKind::invalid, "/dataset",
                         "--beside-set: the dataset of the second picture is that of --beside "
                         "DATASET, and without it that of the first");
  }
  if (view.camera != one.camera) {
    return make_error_at(ErrorKind::invalid, "/camera",
                         "--beside-set: both pictures have the camera of the first");
  }
  if (view.image.width != one.image.width || view.image.height != one.image.height) {
    return make_error_at(ErrorKind::invalid, "/image",
                         "--beside-set: both pictures have the size of the first");
  }
  for (const protocol::View* each : std::array<const protocol::View*, 2>{&one, &view}) {
    if (each->quality.budget_ms || each->quality.max_error) {
      return make_error_at(ErrorKind::invalid, "/quality",
                           "limits on time or error may change the size of a picture, and two side "
                           "by side have the same: set budgetMs and maxError to null");
    }
  }
  return view;
}

const std::string& title_of(const Panel& panel) {
  const data::DatasetInfo& info = panel.dataset->info();
  const auto& own = panel.view.annotations.title_text;
  return own ? *own : info.title.empty() ? info.id : info.title;
}

// Appends what tells a picture apart to its title, unless that cannot be written.
void append_to_title(Panel& panel, const std::string& text) {
  protocol::View named = panel.view;
  named.annotations.title_text = title_of(panel) + "  \u00b7  " + text;
  if (frame::check_title(named)) panel.view = std::move(named);
}

void tell_apart(const ViewArguments& arguments, Panel& first, Panel& second) {
  if (title_of(first) != title_of(second)) return;
  const std::string& id = first.dataset->info().id;
  const std::string& other = second.dataset->info().id;
  if (id != other) {
    append_to_title(first, id);
    append_to_title(second, other);
  } else if (first.view.step == second.view.step) {
    std::string text;
    for (const std::string& setting : arguments.beside_settings) {
      if (setting.starts_with("/difference")) continue;  // a line of its own says so
      text += (text.empty() ? "" : ", ") + setting;
    }
    if (!text.empty()) append_to_title(second, text);
  }
}

Result<void> link(Panel& first, Panel& second) {
  const auto one = frame::complete(first.view, *first.dataset, true);
  if (!one) return one.error();
  protocol::View asked = second.view;
  asked.camera = one->view().camera;
  const auto other = frame::complete(asked, *second.dataset, true);
  if (!other) return of_second(other.error());
  std::array<protocol::View, 2> full{one->view(), other->view()};
  share_defaults({{{first.view, full[0], first.dataset->info()},
                   {second.view, full[1], second.dataset->info()}}});
  first.view = std::move(full[0]);
  second.view = std::move(full[1]);
  return {};
}

}  // namespace

Result<std::vector<Panel>> open_panels(const ViewArguments& arguments) {
  const auto document = assemble_view(arguments);
  if (!document) return document.error();
  std::vector<Panel> panels(1);
  panels[0].view = document->view();
  panels[0].asked = panels[0].view;
  if (arguments.is_pair()) {
    auto second = second_view(arguments, *document);
    if (!second) return second.error();
    panels.push_back({*second, nullptr, !arguments.beside_step.empty(), *second});
  }
  const auto opened = open_datasets(arguments);
  if (!opened) return opened.error();
  auto shown = shown_dataset(panels[0].view, opened->first, opened->minus);
  if (!shown) return shown.error();
  panels[0].dataset = std::move(*shown);
  if (panels.size() == 1) return panels;
  auto other =
      shown_dataset(panels[1].view, opened->beside ? opened->beside : opened->first, opened->minus);
  if (!other) return of_second(other.error());
  panels[1].dataset = std::move(*other);
  tell_apart(arguments, panels[0], panels[1]);
  if (auto linked = link(panels[0], panels[1]); !linked) return linked.error();
  return panels;
}

}  // namespace windsplat::cli
