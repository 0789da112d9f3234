// Times reported by the render jobs of a session, and sharing of scarce memory.
#include "server/tasks/viewer.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/frame/content.hpp"
#include "server/frame/frame.hpp"
#include "server/scene/completed_view.hpp"
#include "server/transport/server_parts.hpp"
#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

using namespace windsplat;  // NOLINT(google-build-using-namespace)

// Whether data were prepared for the frame, so that the next one of its kind is faster.
bool prepared(tasks::Viewer& viewer, std::uint64_t ticket, const protocol::View& view,
              const quality::Setting& setting = {}) {
  std::promise<bool> told;
  viewer.start(session::StartRender{ticket, view, setting, {}},
               [&](std::uint64_t /*ticket*/, Result<session::Drawn> drawn) {
                 EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
                 told.set_value(drawn && drawn->loaded);
               });
  const bool loaded = told.get_future().get();
  viewer.done(ticket);
  return loaded;
}

protocol::View view_of_small(int width, int height) {
  protocol::View view;
  view.dataset = "small";
  view.image.width = width;
  view.image.height = height;
  return view;
}

TEST(Viewer, WaitForAveragesIsReportedLikeAWaitForFields) {
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add(small_file()).value();
  transport::ServerParts parts({}, store, std::make_shared<ThreadPool>(2));
  tasks::Viewer viewer(parts.backend, 1, "192.0.2.1");
  protocol::View view = view_of_small(16, 12);
  view.method.detail = protocol::Detail::full;
  EXPECT_TRUE(prepared(viewer, 1, view));
  EXPECT_FALSE(prepared(viewer, 2, view));
  ASSERT_EQ(dataset->levels(), 0U);
  const std::uint64_t loads = dataset->loads();
  view.method.detail = protocol::Detail::automatic;
  EXPECT_TRUE(prepared(viewer, 3, view));
  ASSERT_GT(dataset->levels(), 0U) << "the picture is too large for a coarser level";
  EXPECT_EQ(dataset->loads(), loads);
  EXPECT_FALSE(prepared(viewer, 4, view));
}

// The first frame waits for its fields, the second one is drawn at another setting, and the view is
// calibrated too.
TEST(Viewer, CompletesAViewOnceForAllThatIsDrawnOfIt) {
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add(small_file()).value();
  transport::ServerParts parts({}, store, std::make_shared<ThreadPool>(2));
  tasks::Viewer viewer(parts.backend, 1, "192.0.2.1");
  protocol::View view = view_of_small(96, 72);
  const std::uint64_t before = scene::completions();
  EXPECT_TRUE(prepared(viewer, 1, view));
  EXPECT_FALSE(prepared(viewer, 2, view, {protocol::MethodName::kernel, 2}));
  viewer.start(session::Calibrate{view});
  std::promise<void> calibrated;
  ASSERT_TRUE(parts.backend.loads.submit(
      {{}, [&] { calibrated.set_value(); }, true, dataset->shared_info()}));
  calibrated.get_future().wait();
  EXPECT_EQ(scene::completions() - before, 1U);
  view.camera.eye = protocol::Vec3{3, -3, 2};
  EXPECT_FALSE(prepared(viewer, 3, view));
  EXPECT_EQ(scene::completions() - before, 2U) << "another view";
}

// What a view shows is computed after its final frame. The picture is too small to be calibrated.
class Descriptions : public testing::Test {
 protected:
  // Draws the final frame and keeps what is known of its view.
  void draw_final() {
    std::promise<session::Drawn> told;
    session::Encoding final;
    final.measure = true;
    viewer_.start(session::StartRender{1, view_, {protocol::MethodName::slab, 0}, final},
                  [&](std::uint64_t /*ticket*/, Result<session::Drawn> drawn) {
                    EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
                    told.set_value(drawn ? std::move(*drawn) : session::Drawn());
                  });
    drawn_ = told.get_future().get();
    viewer_.done(1);
  }
  // Where the content is unknown, estimates of smaller pictures are less certain.
  double spread() {
    quality::Viewpoint unknown = drawn_.viewpoint;
    unknown.content.reset();
    return parts_.backend.quality.forecasts(drawn_.signature, unknown)[2].spread;
  }
  std::future<void> loads_done() {
    const auto done = std::make_shared<std::promise<void>>();
    EXPECT_TRUE(parts_.backend.loads.submit(
        {{}, [done] { done->set_value(); }, true, dataset_->shared_info()}));
    return done->get_future();
  }

  std::shared_ptr<data::Store> store_ = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  std::shared_ptr<data::Dataset> dataset_ = store_->add(small_file()).value();
  transport::ServerParts parts_{{}, store_, std::make_shared<ThreadPool>(2)};
  tasks::Viewer viewer_{parts_.backend, 1, "192.0.2.1"};
  protocol::View view_ = view_of_small(60, 48);
  session::Drawn drawn_;
};

TEST_F(Descriptions, FollowTheFinalFrame) {
  draw_final();
  EXPECT_EQ(drawn_.info.error_kind, "measured");
  EXPECT_FALSE(drawn_.viewpoint.content);
  const double before = spread();
  viewer_.start(session::Calibrate{view_});
  loads_done().wait();
  EXPECT_LT(spread(), 0.99 * before);
}

// Neither again at rest nor for its next final frame, which has its content.
TEST_F(Descriptions, OfAViewAreMadeOnce) {
  draw_final();
  const std::uint64_t before = frame::descriptions();
  for (int visits = 0; visits < 2; ++visits) {
    viewer_.start(session::Calibrate{view_});
    loads_done().wait();
  }
  EXPECT_EQ(frame::descriptions() - before, 1U);
  draw_final();
  EXPECT_TRUE(drawn_.viewpoint.content);
  EXPECT_EQ(frame::descriptions() - before, 1U);
  view_.step = 1;
  draw_final();
  EXPECT_FALSE(drawn_.viewpoint.content) << "of another step";
  viewer_.start(session::Calibrate{view_});
  loads_done().wait();
  EXPECT_EQ(frame::descriptions() - before, 2U);
}

TEST_F(Descriptions, OfAnOldViewEndWhenANewOneArrives) {
  draw_final();
  const double before = spread();
  std::promise<void> held;
  std::promise<void> holding;
  ASSERT_TRUE(parts_.backend.loads.submit({{},
                                           [&] {
                                             holding.set_value();
                                             held.get_future().wait();
                                           },
                                           true,
                                           dataset_->shared_info()}));
  holding.get_future().wait();
  viewer_.start(session::Calibrate{view_});
  protocol::View next = view_;
  next.camera.eye = protocol::Vec3{3, -3, 2};
  EXPECT_FALSE(prepared(viewer_, 2, next));
  held.set_value();
  loads_done().wait();
  EXPECT_EQ(spread(), before);
}

// The data of one and a half steps fit: every frame waits until the previous ones are drawn.
TEST(Viewer, SessionsAtDifferentStepsGetFramesWhenOneStepFits) {
  constexpr std::uint64_t sample_bytes = 4 * sizeof(float);  // a wind and a cloud
  constexpr std::uint64_t step_bytes = std::uint64_t{32} * 16 * 6 * sample_bytes;
  const auto store = std::make_shared<data::Store>(step_bytes * 3 / 2);
  ASSERT_TRUE(store->add(small_file()));
  transport::ServerParts parts({}, store, std::make_shared<ThreadPool>(2));
  constexpr int viewers_count = 8;
  constexpr int rounds = 5;
  std::vector<std::unique_ptr<tasks::Viewer>> viewers;
  for (int v = 0; v < viewers_count; ++v) {
    viewers.push_back(std::make_unique<tasks::Viewer>(
        parts.backend, static_cast<std::uint64_t>(v + 1), "192.0.2.1"));
  }
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::promise<std::string>> faults(viewers_count);
    for (int v = 0; v < viewers_count; ++v) {
      protocol::View view;
      view.dataset = "small";
      view.step = (v + round) % small_steps;
      view.image.width = 64;
      view.image.height = 48;
      view.method.detail = protocol::Detail::full;
      std::promise<std::string>& fault = faults[static_cast<std::size_t>(v)];
      viewers[static_cast<std::size_t>(v)]->start(
          session::StartRender{static_cast<std::uint64_t>(round + 1), view, {}, {}},
          [&fault](std::uint64_t /*ticket*/, const Result<session::Drawn>& drawn) {
            fault.set_value(drawn ? "" : drawn.error().message);
          });
    }
    for (int v = 0; v < viewers_count; ++v) {
      EXPECT_EQ(faults[static_cast<std::size_t>(v)].get_future().get(), "")
          << "viewer " << v << ", round " << round;
      viewers[static_cast<std::size_t>(v)]->done(static_cast<std::uint64_t>(round + 1));
    }
    EXPECT_LE(store->counts().bytes, store->counts().bytes_max);
  }
}

// One picture with more pixels than are reserved, and the data of one and a half steps.
class LargePictures : public testing::Test {
 protected:
  static constexpr std::uint64_t step_bytes = std::uint64_t{32} * 16 * 6 * 4 * sizeof(float);
  LargePictures() {
    view_.dataset = "small";
    view_.image.width = 2048;
    view_.image.height = 1104;
    view_.method.detail = protocol::Detail::full;
    store_ = std::make_shared<data::Store>(
        frame::bytes_beyond_kept(2048, 1104, frame::Format::jpeg) + step_bytes * 3 / 2);
    EXPECT_TRUE(store_->add(small_file()));
    parts_ = std::make_unique<transport::ServerParts>(api::ServerOptions{}, store_,
                                                      std::make_shared<ThreadPool>(2));
  }
  // Why there is no frame; empty if there is one.
  std::future<std::string> fault_of(tasks::Viewer& viewer, const protocol::View& view) {
    const auto told = std::make_shared<std::promise<std::string>>();
    viewer.start(session::StartRender{++tickets_, view, {}, {}},
                 [told](std::uint64_t /*ticket*/, const Result<session::Drawn>& drawn) {
                   told->set_value(drawn ? "" : drawn.error().message);
                 });
    return told->get_future();
  }

  protocol::View view_;
  std::shared_ptr<data::Store> store_;
  std::unique_ptr<transport::ServerParts> parts_;
  std::uint64_t tickets_ = 0;
};

TEST_F(LargePictures, WaitForMemoryHeldByOthers) {
  tasks::Viewer viewer(parts_->backend, 1, "192.0.2.1");
  ASSERT_EQ(fault_of(viewer, view_).get(), "") << "its data are resident from now on";
  auto others = store_->reserve(step_bytes);
  while (!others) {  // memory is released shortly after the reply
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    others = store_->reserve(step_bytes);
  }
  auto fault = fault_of(viewer, view_);
  EXPECT_EQ(fault.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  others = make_error(ErrorKind::internal, "released");
  EXPECT_EQ(fault.get(), "");
}

TEST_F(LargePictures, OfTwoSessionsAreRenderedInTurnWhenOneFits) {
  tasks::Viewer one(parts_->backend, 1, "192.0.2.1");
  tasks::Viewer other(parts_->backend, 2, "192.0.2.2");
  for (int round = 0; round < 4; ++round) {
    view_.step = round % small_steps;
    auto first = fault_of(one, view_);
    view_.step = (round + 1) % small_steps;
    auto second = fault_of(other, view_);
    EXPECT_EQ(first.get(), "") << round;
    EXPECT_EQ(second.get(), "") << round;
    EXPECT_LE(store_->counts().bytes, store_->counts().bytes_max);
  }
}

TEST_F(LargePictures, ThatNeverFitAreRefusedAtOnce) {
  tasks::Viewer viewer(parts_->backend, 1, "192.0.2.1");
  view_.image.height = 2048;
  const std::string fault = fault_of(viewer, view_).get();
  EXPECT_EQ(fault.find("a picture of 2048 x 2048 pixels is too large: memory other than fields"),
            0U)
      << fault;
}

}  // namespace
}  // namespace server_test
