// What a viewer's render jobs tell of the time they took.
#include "server/net/viewer.hpp"

#include <gtest/gtest.h>

#include <future>

#include "net_server.hpp"

namespace net_test {
namespace {

using namespace windsplat;  // NOLINT(google-build-using-namespace)

// Whether data was prepared for the frame, which the next of its kind need not do again.
bool prepared(net::Viewer& viewer, std::uint64_t ticket, const protocol::View& view) {
  std::promise<bool> told;
  viewer.start(session::StartRender{ticket, view, {}, {}},
               [&](std::uint64_t /*ticket*/, Result<session::Drawn> drawn) {
                 EXPECT_TRUE(drawn) << (drawn ? "" : drawn.error().message);
                 told.set_value(drawn && drawn->loaded);
               });
  const bool loaded = told.get_future().get();
  viewer.done(ticket);
  return loaded;
}

TEST(Viewer, AFrameThatWaitedForAveragesSaysSoAsOneThatWaitedForFields) {
  const auto store = std::make_shared<data::Store>(std::uint64_t{1} << 30);
  const auto dataset = store->add(small_file()).value();
  net::Services services({}, store, std::make_shared<ThreadPool>(2));
  net::Viewer viewer(services, 1, "192.0.2.1");
  protocol::View view;
  view.dataset = "small";
  view.image.width = 16;
  view.image.height = 12;
  view.method.detail = protocol::Detail::full;
  EXPECT_TRUE(prepared(viewer, 1, view));
  EXPECT_FALSE(prepared(viewer, 2, view));
  ASSERT_EQ(dataset->averages(), 0U);
  const std::uint64_t loads = dataset->loads();
  view.method.detail = protocol::Detail::automatic;
  EXPECT_TRUE(prepared(viewer, 3, view));
  ASSERT_GT(dataset->averages(), 0U) << "the picture is too large for a coarser level";
  EXPECT_EQ(dataset->loads(), loads);
  EXPECT_FALSE(prepared(viewer, 4, view));
}

}  // namespace
}  // namespace net_test
