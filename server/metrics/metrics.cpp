// Families of prometheus-cpp, and values of other components read on each scrape.
#include "server/metrics/metrics.hpp"

#include <dirent.h>
#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

namespace windsplat::metrics {
namespace {

using prometheus::Counter;
using prometheus::Gauge;
using prometheus::Histogram;
using Families = std::vector<prometheus::MetricFamily>;

constexpr const char* route_other = "other";
constexpr double us_per_s = 1e6;
constexpr std::array<const char*, 4> tier_names{"moving", "rest", "final", "still"};
constexpr std::array<const char*, 5> status_classes{"1xx", "2xx", "3xx", "4xx", "5xx"};

const Histogram::BucketBoundaries& second_bounds() {
  static const Histogram::BucketBoundaries bounds{
      0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.033, 0.066, 0.1, 0.2, 0.5, 1, 2, 5, 10};
  return bounds;
}

const Histogram::BucketBoundaries& error_bounds() {
  static const Histogram::BucketBoundaries bounds{1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3,
                                                  1e-2, 3e-2, 0.1,  0.3,  1};
  return bounds;
}

// A family with one series whose value is counted elsewhere.
void add(Families& out, prometheus::MetricType type, const char* name, const char* help,
         double value) {
  prometheus::ClientMetric metric;
  metric.gauge.value = value;
  metric.counter.value = value;
  out.push_back({name, help, type, {metric}});
}

void add_gauge(Families& out, const char* name, const char* help, double value) {
  add(out, prometheus::MetricType::Gauge, name, help, value);
}

void add_counter(Families& out, const char* name, const char* help, std::uint64_t value) {
  add(out, prometheus::MetricType::Counter, name, help, static_cast<double>(value));
}

void add_labelled(Families& out, const char* name, const char* help, const char* label,
                  const std::vector<std::pair<const char*, std::uint64_t>>& values) {
  prometheus::MetricFamily family{name, help, prometheus::MetricType::Counter, {}};
  for (const auto& [what, value] : values) {
    prometheus::ClientMetric metric;
    metric.label = {{label, what}};
    metric.counter.value = static_cast<double>(value);
    family.metric.push_back(std::move(metric));
  }
  out.push_back(std::move(family));
}

void add_budget(Families& out, const data::BudgetCounts& budget) {
  add_gauge(out, "windsplat_resident_bytes",
            "Bytes of data that are in memory or reserved for a load.",
            static_cast<double>(budget.bytes));
  add_gauge(out, "windsplat_memory_limit_bytes", "Limit on resident data.",
            static_cast<double>(budget.bytes_max));
  add_labelled(out, "windsplat_data_lookups_total",
               "Requests for volumes and their levels, by residency.", "result",
               {{"hit", budget.hits}, {"miss", budget.misses}});
  add_counter(out, "windsplat_data_evictions_total", "Volumes and their levels evicted.",
              budget.evictions);
  add_counter(out, "windsplat_data_refusals_total", "Loads refused for lack of memory.",
              budget.refusals);
  add_labelled(out, "windsplat_volume_loads_total",
               "Volumes read from their files or made by a sample.", "result",
               {{"ok", budget.reads - budget.reads_failed}, {"failed", budget.reads_failed}});
  add_gauge(out, "windsplat_parts_resident_bytes", "Bytes of parts of volumes in memory.",
            static_cast<double>(budget.part_bytes));
}

// Of stores with levels.
void add_bricks(Families& out, const data::BrickCounts& bricks) {
  add_labelled(out, "windsplat_bricks_total",
               "Bricks wanted of stores, by where their samples were.", "from",
               {{"resident", bricks.resident}, {"store", bricks.read}});
  add_counter(out, "windsplat_brick_bytes_read_total",
              "Bytes of samples read of bricks, as they are in memory.", bricks.bytes_read);
  add_gauge(out, "windsplat_bricks_waiting", "Bricks being read or waiting for the reader.",
            static_cast<double>(bricks.waiting));
}

double resident_process_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0;
  double resident = 0;
  statm >> total >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

double open_files() {
  DIR* folder = ::opendir("/proc/self/fd");
  if (folder == nullptr) return std::nan("");
  int count = 0;
  while (::readdir(folder) != nullptr) ++count;
  ::closedir(folder);
  return count - 3;  // ".", ".." and the folder itself
}

void add_process(Families& out) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / us_per_s;
  };
  add_gauge(out, "process_resident_memory_bytes", "Resident memory of this process.",
            resident_process_bytes());
  add(out, prometheus::MetricType::Counter, "process_cpu_seconds_total",
      "User and system processor time of this process.",
      seconds(used.ru_utime) + seconds(used.ru_stime));
  add_gauge(out, "process_open_fds", "Open file descriptors of this process.", open_files());
}

// Registers metrics under their names.
struct Registrar {
  prometheus::Registry& registry;

  Counter& counter(const char* name, const char* help,
                   const prometheus::Labels& labels = {}) const {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add(labels);
  }
  Gauge& gauge(const char* name, const char* help, const prometheus::Labels& labels = {}) const {
    return prometheus::BuildGauge().Name(name).Help(help).Register(registry).Add(labels);
  }
  Histogram& stage(const char* name) const {
    return prometheus::BuildHistogram()
        .Name("windsplat_stage_seconds")
        .Help("Time of a picture in each stage.")
        .Register(registry)
        .Add({{"stage", name}}, second_bounds());
  }
  Counter& frame(const char* tier) const {
    return counter("windsplat_frames_total", "Frames sent to sessions.", {{"tier", tier}});
  }
  Counter& video(const char* picture) const {
    return counter("windsplat_video_frames_total", "Frames sent as H.264.", {{"picture", picture}});
  }
  Counter& bytes(const char* over) const {
    return counter("windsplat_sent_bytes_total", "Bytes sent to sockets, without framing.",
                   {{"over", over}});
  }
  Histogram& error(const char* kind) const {
    return prometheus::BuildHistogram()
        .Name("windsplat_frame_error")
        .Help("Linear RMSE of frames sent, where it is known.")
        .Register(registry)
        .Add({{"kind", kind}}, error_bounds());
  }
  Counter& background(const char* result) const {
    return counter("windsplat_background_jobs_total",
                   "Calibration measurements made while the renderer was idle.",
                   {{"result", result}});
  }
  Counter& limit(const char* name) const {
    return counter("windsplat_refused_total", "Refused work, by the limit exceeded.",
                   {{"limit", name}});
  }
  Counter& opened(const char* result) const {
    return counter("windsplat_dataset_opens_total", "Datasets opened by POST.",
                   {{"result", result}});
  }
};

}  // namespace

struct Metrics::State {
  State() {
    add.gauge("windsplat_build_info", "1, labelled with the version.",
              {{"version", WINDSPLAT_VERSION}})
        .Set(1);
    count_requests_of(route_other);
    for (std::size_t i = 0; i < limit_names.size(); ++i) limits[i] = &add.limit(limit_names[i]);
  }

  void count_requests_of(const char* route) {
    for (std::size_t i = 0; i < status_classes.size(); ++i) {
      requests[route][i] = &add.counter("windsplat_http_requests_total", "HTTP requests answered.",
                                        {{"route", route}, {"status", status_classes[i]}});
    }
  }

  prometheus::Registry registry;
  const Registrar add{registry};
  std::array<Histogram*, 5> stages{&add.stage("queue"), &add.stage("render"), &add.stage("encode"),
                                   &add.stage("write"), &add.stage("describe")};
  std::array<Counter*, 4> frames{&add.frame(tier_names[0]), &add.frame(tier_names[1]),
                                 &add.frame(tier_names[2]), &add.frame(tier_names[3])};
  std::array<Counter*, 2> sent{&add.bytes("http"), &add.bytes("stream")};
  Histogram& estimated = add.error("estimated");
  Histogram& measured = add.error("measured");
  std::array<Counter*, 2> video{&add.video("predicted"), &add.video("key")};
  Gauge& encoders = add.gauge("windsplat_video_encoders", "Encoders of H.264 in use.");
  Counter& video_failures = add.counter("windsplat_video_failures_total",
                                        "Frames sent as JPEG because the video encoder failed.");
  Counter& stand_ins =
      add.counter("windsplat_frames_stand_in_total",
                  "Moving frames sent with coarser data than wanted, which were not in memory.");
  Counter& dropped = add.counter("windsplat_frames_dropped_total",
                                 "Frames drawn but not sent because the view had changed.");
  Counter& cancelled =
      add.counter("windsplat_renders_cancelled_total", "Frames cancelled before they were drawn.");
  Gauge& sessions = add.gauge("windsplat_sessions", "Open sessions.");
  Gauge& unsent = add.gauge("windsplat_unsent_bytes", "Bytes of queued messages.");
  Counter& sessions_opened = add.counter("windsplat_sessions_opened_total", "Sessions opened.");
  Counter& accept_failures =
      add.counter("windsplat_accept_failures_total", "Connections that could not be accepted.");
  Counter& handshakes =
      add.counter("windsplat_tls_handshake_seconds_total", "Processor time of TLS handshakes.");
  Counter& closed = add.counter("windsplat_connections_refused_total",
                                "Connections closed without a response because of a limit.");
  std::array<Counter*, 2> opens{&add.opened("failed"), &add.opened("ok")};
  std::array<Counter*, 2> studies{&add.background("done"), &add.background("cancelled")};
  std::map<std::string, std::array<Counter*, 5>, std::less<>> requests;
  std::array<Counter*, limit_names.size()> limits{};
};

Metrics::Metrics() : state_(std::make_unique<State>()) {}
Metrics::~Metrics() = default;

void Metrics::count_routes(const std::vector<const char*>& routes) {
  for (const char* route : routes) state_->count_requests_of(route);
}

void Metrics::stage_took(Stage stage, std::int64_t us) {
  state_->stages[static_cast<std::size_t>(stage)]->Observe(static_cast<double>(us) / us_per_s);
}

void Metrics::frame_sent(session::Tier tier, const protocol::FrameHeader& header, bool stands_in) {
  state_->frames[static_cast<std::size_t>(tier)]->Increment();
  if (stands_in) state_->stand_ins.Increment();
  if (header.codec == protocol::Codec::h264) {
    const bool key = (header.flags & protocol::flag_key) != 0;
    state_->video[key ? 1 : 0]->Increment();
  }
  if (!std::isfinite(header.error)) return;
  if ((header.flags & protocol::flag_error_measured) != 0) state_->measured.Observe(header.error);
  if ((header.flags & protocol::flag_error_estimated) != 0) {
    state_->estimated.Observe(header.error);
  }
}

void Metrics::video_encoders(int more) { state_->encoders.Increment(more); }

void Metrics::video_failed() { state_->video_failures.Increment(); }

void Metrics::frames_dropped(std::uint64_t count) {
  state_->dropped.Increment(static_cast<double>(count));
}

void Metrics::renders_cancelled(std::uint64_t count) {
  state_->cancelled.Increment(static_cast<double>(count));
}

void Metrics::bytes_sent(Over over, std::size_t bytes) {
  state_->sent[static_cast<std::size_t>(over)]->Increment(static_cast<double>(bytes));
}

void Metrics::unsent(std::int64_t more_bytes) {
  state_->unsent.Increment(static_cast<double>(more_bytes));
}

void Metrics::session_opened() {
  state_->sessions.Increment();
  state_->sessions_opened.Increment();
}

void Metrics::session_closed() { state_->sessions.Decrement(); }

void Metrics::answered(std::string_view route, int status) {
  auto found = state_->requests.find(route);
  if (found == state_->requests.end()) found = state_->requests.find(std::string_view(route_other));
  const int status_class = status / 100 - 1;
  if (status_class < 0 || status_class > 4) return;
  found->second[static_cast<std::size_t>(status_class)]->Increment();
}

void Metrics::accept_failed() { state_->accept_failures.Increment(); }

void Metrics::handshake_took(std::int64_t us) {
  state_->handshakes.Increment(static_cast<double>(us) / us_per_s);
}

void Metrics::connection_refused() { state_->closed.Increment(); }

void Metrics::refused(LimitKind kind) {
  state_->limits[static_cast<std::size_t>(kind)]->Increment();
}

void Metrics::dataset_opened(bool ok) { state_->opens[ok ? 1 : 0]->Increment(); }

void Metrics::background_done(bool cancelled) { state_->studies[cancelled ? 1 : 0]->Increment(); }

std::string Metrics::text(const data::BudgetCounts& budget) const {
  Families families = state_->registry.Collect();
  add_budget(families, budget);
  add_bricks(families, budget.bricks);
  add_process(families);
  std::ostringstream out;
  prometheus::TextSerializer().Serialize(out, families);
  return out.str();
}

}  // namespace windsplat::metrics
