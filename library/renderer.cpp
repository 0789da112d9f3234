// Volume, View -> frame -> pixels.
#include <cstddef>
#include <utility>

#include "library/state.hpp"
#include "protocol/codec.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/frame/frame.hpp"
#include "server/scene/difference/difference.hpp"

namespace windsplat {

struct Renderer::State {
  explicit State(unsigned threads) : pool(threads) {}
  ThreadPool pool;
  frame::Workspace workspace;

  // Draws into the workspace.
  void draw(const data::Dataset& dataset, const std::string& json,
            const frame::Encoding& encoding) {
    protocol::View view = library::taken(protocol::ViewDocument::parse(json)).view();
    view.dataset = dataset.info().id;
    data::Dataset shown = library::taken(scene::with_difference(view, dataset, nullptr));
    const auto completed = library::taken(frame::complete(view, shown, true));
    const auto prepared =
        library::taken(frame::prepare(completed, frame::own_setting(completed), shown, encoding));
    if (auto done = frame::draw(prepared, shown, pool, CancelToken(), workspace); !done) {
      library::throw_problem(done.error());
    }
  }
};

Renderer::Renderer(unsigned threads) : state_(std::make_unique<State>(threads)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Picture Renderer::render(const Volume& volume, const View& view) {
  frame::Encoding encoding;
  encoding.format = frame::Format::png;
  encoding.raw = true;
  state_->draw(*volume.state_->dataset, view.json_, encoding);
  frame::Frame drawn = library::taken(frame::encode(state_->workspace, state_->pool));
  Picture picture;
  picture.width = drawn.width;
  picture.height = drawn.height;
  picture.empty = std::move(drawn.empty);
  const std::size_t pixels = drawn.bytes.size() / 3;
  picture.rgba.resize(pixels * 4);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgba[4 * i + c] = drawn.bytes[3 * i + c];
    picture.rgba[4 * i + 3] = 255;
  }
  return picture;
}

LinearPicture Renderer::render_linear(const Volume& volume, const View& view) {
  frame::Encoding encoding;
  encoding.format = frame::Format::npy;
  state_->draw(*volume.state_->dataset, view.json_, encoding);
  const auto& image = state_->workspace.space.image();
  return {image.width,
          image.height,
          {image.rgba.begin(), image.rgba.end()},
          std::move(state_->workspace.drawn.empty)};
}

}  // namespace windsplat
