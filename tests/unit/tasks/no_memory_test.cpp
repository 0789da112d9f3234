// Allocation failures in executors: no partial state remains, and none of their threads ends.
// Allocations of a thread fail, beginning with the n-th.
#include <gtest/gtest.h>
#include <signal.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <future>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <utility>

#include "server/access/admission.hpp"
#include "server/data/loader/process.hpp"
#include "server/tasks/jobs.hpp"
#include "server/tasks/render_service.hpp"
#include "server/tasks/run_guarded.hpp"
#include "server/tasks/task_executor.hpp"
#include "server/transport/listener.hpp"
#include "server/transport/post_or_retry.hpp"

namespace {

constexpr int enough = -1;
thread_local int allocations_left = enough;

}  // namespace

// Not inlined: the compiler would report a mismatch of malloc and delete.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (allocations_left == 0) throw std::bad_alloc();
  if (allocations_left > 0) --allocations_left;
  if (void* const memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace windsplat::tasks {
namespace {

// Whether `body` succeeded with that many allocations.
template <class Body>
bool with_allocations(int count, const Body& body) {
  allocations_left = count;
  try {
    body();
    allocations_left = enough;
    return true;
  } catch (const std::bad_alloc&) {
    allocations_left = enough;
    return false;
  }
}

// A job whose copy allocates too, for the name of its payer.
RenderJob allocating_job(RenderKind kind, std::uint64_t owner) {
  RenderJob job;
  job.kind = kind;
  job.owner = owner;
  job.payer = "an address that is longer than sixteen bytes";
  job.run = [](std::int64_t /*queue_us*/) {};
  return job;
}

TEST(NoMemory, JobThatCannotBeQueuedChangesNothing) {
  for (const RenderKind kind : {RenderKind::stream, RenderKind::request, RenderKind::background}) {
    int failed = 0;
    for (int count = 0;; ++count) {
      RenderQueue queue;
      queue.push(allocating_job(kind, 1), 0);
      RenderJob later = allocating_job(kind, 2);
      if (with_allocations(count, [&] { queue.push(std::move(later), 0); })) break;
      ++failed;
      const auto first = queue.pop();
      ASSERT_TRUE(first);
      EXPECT_EQ(first->job.owner, 1U);
      queue.done(10);
      EXPECT_TRUE(queue.empty());
      EXPECT_FALSE(queue.pop()) << count;
      // A failed job still counts as a turn of its owner.
      queue.push(allocating_job(kind, 2), 0);
      ASSERT_TRUE(queue.pop());
      queue.done(10);
      EXPECT_TRUE(queue.empty());
    }
    EXPECT_GE(failed, 3);
  }
}

TEST(NoMemory, AddressIsRegisteredWholeOrNotAtAll) {
  const std::string here = "2001:db8:1:2:3:4:5:6";
  int failed = 0;
  for (int count = 0;; ++count) {
    access::Quota quota(access::Limits{});
    if (with_allocations(count, [&] { quota.connect(here, false, 0); })) break;
    ++failed;
    EXPECT_EQ(quota.known(), 0U);
    EXPECT_EQ(quota.connections(), 0U);
  }
  EXPECT_GE(failed, 2);
}

TEST(NoMemory, NoConnectionOrSessionSlotIsLost) {
  access::Limits limits;
  limits.connections = 1;
  limits.sessions_per_address = 1;
  const std::string here = "2001:db8:1:2:3:4:5:6";
  int failed = 0;
  for (int count = 0;; ++count) {
    metrics::Metrics metrics;
    access::Admission admission(limits, metrics, [] { return 0; });
    const auto both = [&] {
      const auto visitor = admission.connect(here);
      const auto seat = admission.open_session("2001:db8:1:2::/64");
      // Releasing needs no memory.
      allocations_left = 0;
    };
    const bool through = with_allocations(count, both);
    const auto again = admission.connect(here);
    ASSERT_TRUE(again);
    EXPECT_FALSE(again->reserve) << count;
    EXPECT_TRUE(admission.open_session("2001:db8:1:2::/64").place) << count;
    if (through) break;
    ++failed;
  }
  EXPECT_GE(failed, 4);
}

TEST(NoMemory, FailedAttemptIsReportedWithoutAllocating) {
  const CancelToken cancel;
  const CancelToken raised;
  raised.cancel();
  const std::function<Result<int>()> out_of_memory = []() -> Result<int> {
    throw std::bad_alloc();
  };
  const std::function<Result<int>()> broken = []() -> Result<int> { throw std::exception(); };
  ErrorKind first{};
  ErrorKind second{};
  ErrorKind third{};
  EXPECT_TRUE(with_allocations(0, [&] {
    first = std::move(run_guarded<int>("a test", cancel, out_of_memory)).error().kind;
    second = std::move(run_guarded<int>("a test", cancel, broken)).error().kind;
    third = std::move(run_guarded<int>("a test", raised, broken)).error().kind;
  }));
  EXPECT_EQ(first, ErrorKind::out_of_memory);
  EXPECT_EQ(second, ErrorKind::internal);
  EXPECT_EQ(third, ErrorKind::out_of_memory) << "no memory for the message";
}

// The thread cannot allocate, beginning with the first job.
TEST(NoMemory, ThreadsOfServicesContinue) {
  TaskExecutor loads({"loads", 1, 4});
  std::promise<void> loaded;
  EXPECT_TRUE(loads.submit({{}, [] {
                              allocations_left = 0;
                              throw std::bad_alloc();
                            }}));
  EXPECT_TRUE(loads.submit({{}, [&] { loaded.set_value(); }, false, std::make_shared<int>(0)}));
  loaded.get_future().wait();

  RenderService::Options options;
  options.charge = [](const std::string&, std::int64_t) { throw std::bad_alloc(); };
  RenderService renderer(options);
  std::promise<void> drawn;
  RenderJob failing = allocating_job(RenderKind::request, 1);
  failing.run = [](std::int64_t /*queue_us*/) {
    allocations_left = 0;
    throw std::bad_alloc();
  };
  EXPECT_TRUE(renderer.submit(std::move(failing)));
  RenderJob next = allocating_job(RenderKind::request, 2);
  next.run = [&](std::int64_t /*queue_us*/) { drawn.set_value(); };
  EXPECT_TRUE(renderer.submit(std::move(next)));
  drawn.get_future().wait();
}

TEST(NoMemory, ClientJobThatCannotAllocateIsAFailedJob) {
  Jobs jobs({"jobs", 1, 4});
  const auto ask = [&] {
    return jobs
        .submit("test",
                [](const Jobs::Handle&) -> Result<protocol::JobResult> {
                  allocations_left = 0;
                  throw std::bad_alloc();
                })
        .value()
        .id;
  };
  const std::string first = ask();
  const std::string second = ask();  // cannot allocate even at the start
  for (const std::string& id : {first, second}) {
    while (jobs.find(id).value().state == "queued" || jobs.find(id).value().state == "running") {
      std::this_thread::yield();
    }
    EXPECT_EQ(jobs.find(id).value().state, "failed");
  }
}

TEST(NoMemory, CallbackThatCannotBePostedRunsInPlaceOrIsCancelled) {
  boost::asio::io_context io;
  int called = 0;
  const auto call = [&] { ++called; };
  const std::chrono::milliseconds patience(30);
  bool posted = true;
  EXPECT_TRUE(with_allocations(
      0, [&] { posted = transport::post_or_retry(io.get_executor(), call, patience); }));
  EXPECT_FALSE(posted);
  boost::asio::post(io, [&] {
    const boost::asio::any_io_executor executor = io.get_executor();
    EXPECT_TRUE(
        with_allocations(0, [&] { posted = transport::post_or_retry(executor, call, patience); }));
    EXPECT_TRUE(posted);
    EXPECT_EQ(called, 1);
    EXPECT_TRUE(transport::post_or_retry(executor, call));
    EXPECT_EQ(called, 1) << "not before its turn";
  });
  io.run();
  EXPECT_EQ(called, 2);
}

TEST(NoMemory, LoaderEndsWithItsObject) {
  auto process = std::make_unique<data::loader::Process>();
  ASSERT_TRUE(process->start(WINDSPLAT_PROGRAM));
  const pid_t id = process->id();
  EXPECT_TRUE(with_allocations(0, [&] { process.reset(); }));
  EXPECT_EQ(::kill(id, 0), -1) << "it still runs";
}

// Data that arrived are lost with the memory they needed; later data are not.
TEST(NoMemory, LostConnectionDoesNotStopTheListener) {
  namespace asio = boost::asio;
  asio::io_context io;
  const auto more = asio::make_work_guard(io);  // a server has timers
  asio::io_context clients;
  int accepted = 0;
  transport::Listener listener(
      io, [&](asio::generic::stream_protocol::socket) { ++accepted; }, [] {});
  ASSERT_TRUE(listener.listen({"127.0.0.1", 0}));
  const asio::ip::tcp::endpoint endpoint(asio::ip::make_address("127.0.0.1"), listener.port());
  listener.start();
  io.poll();
  asio::ip::tcp::socket first(clients);
  first.connect(endpoint);
  ASSERT_FALSE(with_allocations(0, [&] { io.run_one_for(std::chrono::seconds(2)); }));
  EXPECT_EQ(accepted, 0);
  listener.start();
  asio::ip::tcp::socket next(clients);
  next.connect(endpoint);
  for (int turn = 0; turn < 100 && accepted == 0; ++turn) {
    io.run_one_for(std::chrono::milliseconds(20));
  }
  EXPECT_EQ(accepted, 1);
  listener.close();
}

}  // namespace
}  // namespace windsplat::tasks
