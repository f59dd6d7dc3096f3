#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>

#include <sys/resource.h>
#include <unistd.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/core/version.h"
#include "lib/scene/world.h"
#include "pileus/accuracy/power_law.h"
#include "pileus/checkpoint.h"
#include "pileus/film.h"
#include "pileus/kept_volumes.h"
#include "pileus/pileus.h"
#include "pileus/tiles.h"
#include "vdb_io/volumes/reading_notes.h"

namespace pileus {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return uint64_t(usage.ru_maxrss) * 1024;
}

/// Thrown inside a pass to leave the parallel loop; never reaches a caller.
struct PassStopped {};

/// One pass over all tiles at one accuracy.
class Pass {
 public:
  Pass(const Scene& scene, const RenderOptions& options, const World& world, const EffectPlan& plan,
       const Crop& crop, double coarseness)
      : film(crop.x1 - crop.x0, crop.y1 - crop.y0, scene.render.pixel_samples * scene.render.pixel_samples,
             plan),
        tiles(film.image().width, film.image().height, {crop.x0, crop.y0}),
        m_scene(scene),
        m_options(options),
        m_world(world),
        m_crop(crop),
        m_places(places_in_pixel(scene.render.pixel_samples)),
        m_tracer(scene.render.integrator->prepare(
            world, plan, {scene.render.tolerance, coarseness, scene.render.size, scene.render.max_bounces})) {
  }

  /// Renders the tiles that are not done yet. Returns false where it was stopped: `tiles` then says what is
  /// done.
  bool run(const std::function<bool()>& must_stop) {
    const Clock::time_point start = Clock::now();
    try {
      parallel_for(tiles.count(), [&](size_t index) {
        if (tiles.is_done(index)) return;
        render_tile(index, must_stop);
      });
    } catch (const PassStopped&) {
      return false;
    }
    seconds = seconds_since(start);
    return true;
  }

  std::vector<std::string> choices() const { return m_tracer->choices(); }

  Film film;
  TileGrid tiles;
  Counters counters;
  double seconds = 0.0;  ///< that all tiles took, without what was prepared for them

 private:
  void render_tile(size_t index, const std::function<bool()>& must_stop) {
    Counters tile_counters;
    if (const auto all = seen_alike(index)) {
      const auto [lo, hi] = tiles.bounds(index);
      film.fill(lo, hi, *all);
      return finish_tile(index, tile_counters);
    }
    std::vector<Ray> rays;
    std::vector<RayResult> results;
    const std::vector<Vec2i> pixels =
        m_tracer->traces_packets() ? tiles.pixels_of_blocks(index) : tiles.pixels(index);
    rays.reserve(pixels.size() * m_places.size());
    for (const Vec2i& pixel : pixels) append_rays(pixel, rays);
    results.resize(rays.size());
    trace(rays, results, tile_counters, must_stop);
    for (size_t i = 0; i < pixels.size(); ++i) {
      if (!tiles.contains(pixels[i])) continue;
      film.set_pixel(pixels[i].x, pixels[i].y,
                     std::span(results).subspan(i * m_places.size(), m_places.size()));
    }
    finish_tile(index, tile_counters);
  }

  /// What all rays of a tile see, where that is known beforehand.
  std::optional<RayResult> seen_alike(size_t index) const {
    const auto [lo, hi] = tiles.bounds(index);
    const Vec2d corner(m_crop.x0, m_crop.y0);
    const auto beam = m_world.camera->beam(Vec2d(lo) + corner, Vec2d(hi) + corner, m_scene.render.size);
    return beam ? m_tracer->seen_alike(*beam) : std::nullopt;
  }

  /// Traces as many rays at a time as the integrator likes; an interruption is heard in between.
  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& tile_counters,
             const std::function<bool()>& must_stop) const {
    const size_t batch = m_tracer->rays_per_call();
    for (size_t first = 0; first < rays.size(); first += batch) {
      if (must_stop && must_stop()) throw PassStopped{};
      const size_t count = std::min(batch, rays.size() - first);
      m_tracer->trace(rays.subspan(first, count), results.subspan(first, count), tile_counters);
    }
  }

  /// Where the rays of a pixel pass through it: n x n of them.
  static std::vector<Vec2d> places_in_pixel(int n) {
    std::vector<Vec2d> places;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) places.emplace_back((i + 0.5) / n, (j + 0.5) / n);
    }
    return places;
  }

  void append_rays(const Vec2i& pixel, std::vector<Ray>& rays) const {
    // Pixels beyond the picture, which fill up packets, repeat those at its edge.
    const int x = std::min(m_crop.x0 + pixel.x, m_scene.render.size.x - 1),
              y = std::min(m_crop.y0 + pixel.y, m_scene.render.size.y - 1);
    for (const Vec2d& place : m_places)
      rays.push_back(m_world.camera->ray(Vec2d(x, y) + place, m_scene.render.size));
  }

  void finish_tile(size_t index, const Counters& tile_counters) {
    const std::lock_guard lock(m_mutex);
    for (const auto& [name, count] : tile_counters) counters[name] += count;
    tiles.set_done(index);
    if (m_options.progress) m_options.progress(tiles.share_done());
  }

  const Scene& m_scene;
  const RenderOptions& m_options;
  const World& m_world;
  Crop m_crop;
  std::vector<Vec2d> m_places;  ///< of rays in a pixel
  std::unique_ptr<const Tracer> m_tracer;
  std::mutex m_mutex;
};

Crop checked_crop(const Scene& scene, const RenderOptions& options) {
  const Vec2i size = scene.render.size;
  const Crop crop = options.crop.value_or(Crop{0, 0, size.x, size.y});
  const bool is_inside = 0 <= crop.x0 && crop.x0 < crop.x1 && crop.x1 <= size.x &&  //
                         0 <= crop.y0 && crop.y0 < crop.y1 && crop.y1 <= size.y;
  if (!is_inside) {
    throw Error(ErrorKind::usage, SourceLoc{},
                fmt::format("crop {},{},{},{} is empty or not inside the picture of {} x {} pixels", crop.x0,
                            crop.y0, crop.x1, crop.y1, size.x, size.y));
  }
  return crop;
}

/// Refuses a picture that cannot be held: a typing slip in a size must not drive the machine into swapping.
void check_memory(const Crop& crop) {
  constexpr double kBytesPerPixel = 10 * sizeof(float);  // all planes and the error estimates
  const double needed = kBytesPerPixel * (crop.x1 - crop.x0) * (crop.y1 - crop.y0);
  const double present = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
  if (needed > present) {
    throw Error(ErrorKind::failed, SourceLoc{},
                fmt::format("a picture of {} x {} pixels needs up to {:.1f} GB; this machine has {:.1f} GB",
                            crop.x1 - crop.x0, crop.y1 - crop.y0, 1e-9 * needed, 1e-9 * present));
  }
}

[[noreturn]] void throw_cancelled() {
  throw Error(ErrorKind::cancelled, SourceLoc{}, "interrupted");
}

/// Renders at full accuracy, from a checkpoint where there is one; leaves one behind where it is interrupted.
void render_fully(Pass& pass, const RenderOptions& options, const std::string& fingerprint) {
  const bool has_checkpoint = !options.checkpoint.empty();
  if (has_checkpoint) load_checkpoint(options.checkpoint, fingerprint, pass.film, pass.tiles);
  if (!pass.run(options.is_cancelled)) {
    if (has_checkpoint) save_checkpoint(options.checkpoint, fingerprint, pass.film, pass.tiles);
    throw_cancelled();
  }
}

/// A limit that even the coarsest picture broke.
void warn_if_late(double seconds, double limit, RenderReport& report) {
  constexpr double kPunctual = 1.1;  // times the limit, and a moment for the rays that were under way
  constexpr double kMoment = 0.1;    // [s]
  if (seconds <= kPunctual * limit + kMoment) return;
  report.warnings.push_back(fmt::format(
      "{:g} s were too short even for the coarsest picture, which took {:.2f} s", limit, seconds));
}

/// What the passes of a render with a time limit have shown of its cost: what any pass takes, which the
/// coarsest tells, and on top of that a power of the coarseness.
class PassCosts {
 public:
  void add(double coarseness, double seconds) {
    if (m_fixed == 0.0) m_fixed = seconds;
    m_coarseness.push_back(coarseness);
    m_seconds.push_back(std::max(seconds - m_fixed, kLeastShare * seconds));
  }

  /// The finest coarseness whose pass is expected to take `seconds` or less; infinite where none is.
  double finest_within(double seconds) const {
    constexpr double kFarthest = 16.0;  // times finer than the last: a law is trusted for a stretch only
    const double last = m_coarseness.back();
    if (!(seconds > m_fixed)) return std::numeric_limits<double>::infinity();
    const double wanted = last * std::pow(m_seconds.back() / (seconds - m_fixed), 1.0 / growth());
    return std::max({wanted, last / kFarthest, 1.0});
  }

 private:
  static constexpr double kLeastShare = 0.02;  ///< of a pass that depends on the coarseness

  /// p of cost ~ coarseness^-p: by the latest two passes, which are nearest to what comes.
  double growth() const {
    constexpr double kUnknown = 1.5, kLeast = 0.25, kMost = 2.5;
    const size_t count = m_coarseness.size();
    if (count < 3) return kUnknown;  // the first pass is all fixed cost
    const auto law = fit_power_law(std::span(m_coarseness).last(2), std::span(m_seconds).last(2));
    return law ? std::clamp(-law->exponent, kLeast, kMost) : kUnknown;
  }

  double m_fixed = 0.0;  ///< [s]
  std::vector<double> m_coarseness, m_seconds;
};

/// Renders coarsely first, then as finely as the passes before say that the time left allows. The coarsest
/// pass may overrun the limit: a late picture is better than none.
std::unique_ptr<Pass> render_within(const std::function<std::unique_ptr<Pass>(double)>& make_pass,
                                    const RenderOptions& options, Clock::time_point start,
                                    double& coarseness) {
  constexpr double kCoarsest = 4096.0;
  constexpr double kReserve = 0.85;    // of the time left: predictions miss
  constexpr double kWorthwhile = 1.2;  // times finer, or the picture at hand will do
  const auto is_cancelled = [&] { return options.is_cancelled && options.is_cancelled(); };
  const auto is_late = [&] { return is_cancelled() || seconds_since(start) > options.time_limit; };
  std::unique_ptr<Pass> best;
  PassCosts costs;
  for (double next = kCoarsest;;) {
    const Clock::time_point pass_start = Clock::now();
    std::unique_ptr<Pass> pass = make_pass(next);
    const bool is_whole = best ? pass->run(is_late) : pass->run(is_cancelled);
    if (is_cancelled()) throw_cancelled();
    if (!is_whole) return best;
    best = std::move(pass);
    coarseness = next;
    if (next == 1.0) return best;
    costs.add(next, seconds_since(pass_start));
    next = costs.finest_within(kReserve * (options.time_limit - seconds_since(start)));
    if (next > 1.0 && next * kWorthwhile > coarseness) return best;
  }
}

void count_bad_pixels(const Image& image, RenderReport& report) {
  Vec2i first(-1);
  const Channel* colours[] = {image.find("R"), image.find("G"), image.find("B")};
  if (!colours[0]) return;
  for (size_t i = 0; i < image.pixel_count(); ++i) {
    if (std::all_of(std::begin(colours), std::end(colours),
                    [&](auto* c) { return std::isfinite(c->values[i]); })) {
      continue;
    }
    if (report.nan_pixels++ == 0) first = Vec2i(int(i % size_t(image.width)), int(i / size_t(image.width)));
  }
  if (report.nan_pixels > 0) {
    report.warnings.push_back(
        fmt::format("{} pixels are not finite numbers, the first at ({}, {}) from the upper left",
                    report.nan_pixels, first.x, first.y));
  }
}

/// What the readers of volumes chose or converted is told, lest it be wrong.
void warn_of_choices(const Scene& scene, const LoadedVolumes& loaded, RenderReport& report) {
  for (size_t i = 0; i < loaded.size(); ++i) {
    const auto* reading = dynamic_cast<const ReadingNotes*>(loaded[i].get());
    if (!reading) continue;
    for (const std::string& note : reading->notes()) {
      report.warnings.push_back(fmt::format("volume \"{}\": {}", scene.volumes[i].name, note));
    }
  }
}

/// Adds to a bound what rounding colours to half the bits changes at most.
void widen_for_halves(const Image& image, std::vector<float>& bound) {
  constexpr float kRelative = 0x1p-11f, kSubnormal = 0x1p-25f, kUp = 1.0f + 0x1p-20f;
  for (const char* name : {"R", "G", "B"}) {
    if (!image.find(name)) return;
  }
  const auto &r = image.find("R")->values, &g = image.find("G")->values, &b = image.find("B")->values;
  for (size_t i = 0; i < bound.size(); ++i) {
    const float brightest = std::max({std::abs(r[i]), std::abs(g[i]), std::abs(b[i])});
    bound[i] = kUp * (bound[i] + kRelative * brightest + kSubnormal);
  }
}

void describe_in_header(const Scene& scene, const Crop& crop, Image& image) {
  image.metadata["version"] = std::string(kVersion);
  image.metadata["scene"] = scene.file;
  image.metadata["sceneHash"] = fmt::format("{:016x}", scene.hash);
  image.metadata["tolerance"] = scene.render.tolerance;
  image.metadata["seed"] = scene.render.seed;
  image.metadata["crop"] = fmt::format("{},{},{},{}", crop.x0, crop.y0, crop.x1, crop.y1);
  image.metadata["worldToCamera"] = scene.camera->camera_from_world();
  image.metadata["worldToNDC"] = scene.camera->screen_from_world(scene.render.size);
}

}  // namespace

Rendering render(const Scene& scene, const RenderOptions& options) {
  const Clock::time_point start = Clock::now();
  const double cpu_start = cpu_seconds();
  const Crop crop = checked_crop(scene, options);
  check_memory(crop);
  const EffectPlan plan = plan_effects(scene);
  Rendering rendering;
  rendering.display = scene.display;
  RenderReport& report = rendering.report;

  with_threads(options.threads, [&] {
    report.threads = thread_count();
    LoadedVolumes loaded = options.kept ? options.kept->load(scene) : load_volumes(scene);
    report.seconds["load"] = seconds_since(start);
    warn_of_choices(scene, loaded, report);
    const Clock::time_point build_start = Clock::now();
    const World world = build_world(scene, std::move(loaded));
    if (options.kept) options.kept->keep(world);
    report.seconds["build"] = seconds_since(build_start);

    if (options.progress) options.progress(0.0);
    const Clock::time_point render_start = Clock::now();
    const auto make_pass = [&](double coarseness) {
      return std::make_unique<Pass>(scene, options, world, plan, crop, coarseness);
    };
    std::unique_ptr<Pass> pass;
    if (options.time_limit > 0.0) {
      pass = render_within(make_pass, options, start, report.coarseness);
      warn_if_late(seconds_since(start), options.time_limit, report);
    } else {
      pass = make_pass(1.0);
      render_fully(*pass, options, fingerprint_of(scene, crop));
    }
    report.counters = std::move(pass->counters);
    report.choices = pass->choices();
    report.max_error_estimate = pass->film.max_error();
    report.mean_error_estimate = pass->film.mean_error();
    report.max_error_bound = pass->film.max_bound();
    report.mean_error_bound = pass->film.mean_bound();
    rendering.image = std::move(pass->film.image());
    report.seconds["render"] = seconds_since(render_start);
    report.seconds["trace"] = pass->seconds;
  });

  describe_in_header(scene, crop, rendering.image);
  report.scene = scene.file;
  report.integrator = scene.render.integrator->plugin_name;
  report.tolerance = scene.render.tolerance;
  report.pixels = rendering.image.pixel_count();
  report.rays = report.pixels * uint64_t(scene.render.pixel_samples) * uint64_t(scene.render.pixel_samples);
  report.effects = plan.effects;
  report.seconds["wall"] = seconds_since(start);
  report.seconds["cpu"] = cpu_seconds() - cpu_start;
  report.peak_memory_bytes = peak_memory_bytes();
  count_bad_pixels(rendering.image, report);
  return rendering;
}

std::vector<std::string> explain_choices(const Scene& scene) {
  const EffectPlan plan = plan_effects(scene);
  const World world = build_world(scene);
  const Accuracy accuracy{scene.render.tolerance, 1.0, scene.render.size, scene.render.max_bounces};
  return scene.render.integrator->prepare(world, plan, accuracy)->choices();
}

void save(const Rendering& rendering, const std::filesystem::path& file, bool half) {
  WriteImageOptions options;
  options.exr.half_colours = half;
  options.display = rendering.display;
  const auto is_bound = [](const Channel& channel) { return channel.name == "error_bound"; };
  if (!half || !rendering.image.find("error_bound")) {
    write_image(file, rendering.image, options);
    return;
  }
  Image image = rendering.image;
  widen_for_halves(image, std::find_if(image.channels.begin(), image.channels.end(), is_bound)->values);
  write_image(file, image, options);
}

}  // namespace pileus
