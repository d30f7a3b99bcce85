// SPDX-License-Identifier: Apache-2.0
#include "convert/reduce/reduce.h"

#include "convert/bake/bake.h"
#include "convert/bake/mlp_pack.h"
#include "convert/reduce/file_anchors.h"
#include "convert/reduce/gsc_checkpoint.h"
#include "convert/reduce/pose_sets.h"
#include "convert/reduce/reduce_manifest.h"
#include "convert/reduce/step_search.h"
#include "format/error.h"
#include "kernels/decode/decode_fragments.h"
#include "format/gsc_file.h"
#include "format/interrupt.h"
#include "kernels/threads/parallel.h"
#include "player/cameras/scene_cameras.h"
#include "runtime/renderer.h"
#include "runtime/scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace gsc {

namespace {

constexpr size_t kFewestCameras = 4;
// Where the verdict is short, the search aims higher by a share of that, and no more often than this: few cameras are no
// good sample of each other.
constexpr int kMostAgain = 4;
constexpr double kAgainShare = 0.6, kAgainMargin = 0.1; // dB

static_assert(PoseLimits{}.weights <= kMostImportancePoses);

} // namespace

// The members are its state from stage to stage.
struct Reducer::State {
    State(const ReduceOptions& options, const ReduceProgress& progress)
        : m_options(options), m_progress(progress), m_workers(options.threads),
          m_file(std::make_shared<const GscFile>(options.input, throwFirstIssue(options.name), GscFile::Read::All,
                                                 options.threads))
    {
        openGsc(m_file->bytes(), m_view, GscCheck::Full, throwFirstIssue(options.name));
        m_scene = Scene::open(m_file, options.name);
        letGo();
        if (m_view.params->flags & kModelCompact) // and it stays so
            m_options.levers |= kLeverCompact;
        const ModelParams& params = *m_view.params;
        if ((m_options.levers & kLeverCompact) &&
            (params.feat_dim != kFastFeatures || params.n_offsets > 4 * kItemsPerLane))
            m_report.warnings.push_back(formatString(
                "--compact: saves no memory of a model of %u features and %u Gaussians an anchor, expected "
                "32 and at most 12; leave it out",
                params.feat_dim, params.n_offsets));
    }

    // What no target has a part in. `bakes`: how many will follow.
    void prepare(size_t bakes)
    {
        const auto start = Clock::now();
        stage("sizes", [&] {
            m_report.before = {m_file->bytes().size(), archiveSize(*m_file, m_view, m_options.threads)};
        });
        m_report.anchors = m_view.header->anchor_count;
        m_report.slots = m_report.anchors * m_view.params->n_offsets;
        stage("poses", [&] { choosePoses(bakes); });
        m_probe.emplace(m_scene, openDevice(), [this] { tell(); });
        letGo();
        stage("weights", [&] { weigh(); });
        m_report.anchors_unseen = uint64_t(std::ranges::count(m_importance->seen, 0u));
        stage("references", [&] {
            std::vector<Camera> cameras = m_poses.search;
            cameras.insert(cameras.end(), m_poses.verdict.begin(), m_poses.verdict.end());
            m_probe->addPoses(cameras);
        });
        std::vector<Mlp> halves = checkpointOf(m_view, m_options.name).mlps;
        roundToHalves(halves);
        m_weights = canonicalMlps(halves);
        m_packed = packMlps(halves, m_view.params->feat_dim, m_view.params->appearance_dim);
        // another order draws ties otherwise: 78 dB in the worst view of a trained model
        const bool by_source = !(m_options.levers & kLeverOrder) || !m_options.target_psnr;
        m_order = anchorOrder(m_view, by_source);
        m_model.emplace(m_scene->view(), *m_importance, m_workers, m_weights, m_packed, whenRead());
        if (!by_source)
            m_model->setOrder(numbersOf(m_order));
        m_report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
        m_prepared = m_report;
    }

    // One file, with a target of its own.
    ReduceReport bakeTo(const std::string& output, std::optional<double> target, std::optional<double> min_view,
                        bool last)
    {
        const auto start = Clock::now();
        m_report = m_prepared;
        m_output = output;
        m_target = target;
        m_report.target = target.value_or(0);
        m_report.min_view = target ? min_view.value_or(*target - 4) : 0;
        m_report.plan.levers = m_options.levers;
        m_margin = kSearchMargin;
        stage("search", [&] { search(); });
        stage("verdict", [&] { judge(); });
        for (int again = 0; lack() > 0; ++again) {
            if (again == kMostAgain)
                refuse(m_report.verdict, "verdict", "though poses of the search keep more");
            m_margin += kAgainShare * lack() + kAgainMargin;
            m_pictures += 3 * m_poses.search.size() + m_poses.verdict.size();
            stage("search", [&] { search(); });
            stage("verdict", [&] { judge(); });
        }
        m_report.anchors_left_out = m_model->leftOut();
        m_report.slots_masked = m_model->masked();
        if (last) {
            m_probe.reset();
            m_importance.reset();
        }
        stage("write", [&] { write(last); });
        m_report.seconds += std::chrono::duration<double>(Clock::now() - start).count();
        return std::move(m_report);
    }

    FileScore measure(const std::string& path)
    {
        m_pictures += kDrawsToMeasure * m_poses.verdict.size();
        return m_probe->measure(Scene::open(path), m_poses.search.size(), m_poses.verdict.size());
    }

    [[nodiscard]] const ReduceReport& prepared() const { return m_prepared; }

private:
    using Clock = std::chrono::steady_clock;

    template <typename Work>
    void stage(const char* name, Work&& work)
    {
        throwIfInterrupted();
        const auto start = Clock::now();
        work();
#if defined(__GLIBC__)
        (void)malloc_trim(0); // what threads have freed is kept for threads to come, which mostly have other needs
#endif
        m_report.stages.push_back({name, std::chrono::duration<double>(Clock::now() - start).count()});
    }

    // What is read of the source from here on is read again.
    void letGo() const
    {
        m_file->letGo(m_file->bytes());
    }

    [[nodiscard]] ChunkRead whenRead() const
    {
        return [this](uint32_t chunk) { m_file->letGo(chunkPayload(m_view, m_view.chunks[chunk])); };
    }

    // A picture was drawn.
    void tell()
    {
        letGo();
        ++m_drawn;
        if (m_progress)
            m_progress("bake", std::min(m_drawn, m_pictures), m_pictures);
    }

    static std::vector<uint32_t> numbersOf(const std::vector<uint32_t>& order)
    {
        std::vector<uint32_t> numbers(order.size());
        for (uint32_t i = 0; i < order.size(); ++i)
            numbers[order[i]] = i;
        return numbers;
    }

    // What draws, with the whole model loaded.
    std::unique_ptr<Renderer> openDevice()
    {
        std::vector<std::string> passed_over;
        std::unique_ptr<Renderer> renderer =
            makeLoadedRenderer(m_options.device, {m_options.threads}, m_scene, passed_over);
        m_report.device = deviceText(renderer->id());
        m_report.warnings = std::move(passed_over);
        return renderer;
    }

    void choosePoses(size_t bakes)
    {
        std::vector<Camera> cameras;
        for (const std::string& path : m_options.cameras)
            std::ranges::move(sceneCameras(*m_scene, path, nullptr), std::back_inserter(cameras));
        if (m_options.cameras.empty())
            cameras = sceneCameras(*m_scene, "stored", nullptr);
        leaveOutRepeats(cameras); // or the verdict would look from where the weights did
        if (cameras.size() < kFewestCameras)
            throw Error(ErrorCode::Usage,
                        formatString("%s: %zu different cameras, expected %zu or more to find weights, steps and a "
                                     "verdict from; pass --cameras FILE",
                                     m_options.name.c_str(), cameras.size(), kFewestCameras));
        m_poses = splitPoses(std::move(cameras), m_options.limits);
        m_report.weight_poses = m_poses.weights.size();
        const size_t search = m_poses.search.size(), verdict = m_poses.verdict.size();
        m_pictures = m_poses.weights.size() + search + verdict +
                     bakes * (verdict + (m_options.target_psnr ? searchPictures(search) : search));
    }

    void weigh()
    {
        ImportanceMeter meter(m_scene->view(), m_options.threads, whenRead());
        for (const Camera& camera : m_poses.weights) {
            throwIfInterrupted();
            const EyeParams eye = m_probe->eyeOf(camera);
            const FrameOptions options = m_probe->optionsOf(camera);
            meter.add(eye, options);
            meter.lookFrom(eye.center, options.appearance);
            m_weight_pixels += uint64_t(camera.width) * camera.height;
            tell();
        }
        m_importance.emplace(std::move(meter).take());
    }

    void search()
    {
        if (!m_target) {
            m_report.plan.levers = m_options.levers & (kLeverSlots | kLeverAnchors | kLeverCompact);
            m_model->apply(m_report.plan);
            m_report.search = m_probe->score(m_model->view(), 0, m_poses.search.size());
            m_report.levers = m_report.plan.levers;
            return;
        }
        SearchTask task{*m_model, *m_probe, m_poses.search.size(), m_weight_pixels, m_options.levers};
        task.target = m_report.target;
        task.min_view = m_report.min_view;
        task.margin = m_margin;
        const ReducePlan before = m_report.plan;
        if (m_report.probes > 0)
            task.from = &before;
        const SearchResult found = searchSteps(task);
        m_report.plan = found.plan;
        m_report.levers = found.plan.levers;
        m_report.search = found.score;
        m_report.probes += found.probes;
        if (!found.kept)
            refuse(found.score, "search", "the steps could be no finer");
    }

    void judge()
    {
        m_report.verdict = m_probe->score(m_model->view(), m_poses.search.size(), m_poses.verdict.size());
    }

    // dB that the verdict is short of what was asked for.
    [[nodiscard]] double lack() const
    {
        return m_target ? std::max(m_report.target - m_report.verdict.psnr,
                                   m_report.min_view - m_report.verdict.worstPose().psnr)
                        : 0;
    }

    [[noreturn]] void refuse(const SetScore& score, const char* set, const char* why) const
    {
        const PoseScore& worst = score.worstPose();
        throw Error(ErrorCode::Difference,
                    formatString("%s: the poses of the %s have %.2f dB together and %.2f dB at %s, expected %.2f and "
                                 "%.2f (%s); nothing was written, pass another --target-psnr or --min-view-psnr, more "
                                 "--cameras or fewer --levers%s",
                                 m_options.name.c_str(), set, score.psnr, worst.psnr, worst.name.c_str(),
                                 m_report.target, m_report.min_view, why,
                                 m_options.levers & kLeverCompact ? ", or leave --compact out" : ""));
    }

    void write(bool last)
    {
        Checkpoint checkpoint = checkpointOf(m_view, m_options.name);
        if (m_report.levers & kLeverNetworks)
            roundToHalves(checkpoint.mlps);
        if (m_model->masked() > 0)
            checkpoint.flags |= kModelMaskedSlots;
        if (m_report.levers & kLeverCompact)
            checkpoint.flags |= kModelCompact;
        const std::vector<AnchorPlace> places = keptPlaces(m_view, *m_model, m_order);
        const std::vector<GscView> files{m_view};
        FileAnchors source(files, places, &*m_model);
        checkpoint.anchor_count = places.size();
        if (checkpoint.anchor_count == 0)
            throw Error(ErrorCode::Difference, m_options.name + ": no anchor would be left, expected one; no pose sees "
                                                                "any, pass other --cameras");
        BakeOptions bake;
        bake.output = m_output;
        bake.overwrite = m_options.overwrite;
        bake.threads = m_options.threads;
        // the row that a file of one has; options of a file of several that is said to be of one are not taken over
        if (m_view.embedding_rows.size() == 1)
            bake.appearance = int(m_view.embedding_rows[0]);
        bake.sensitivity = SensitivityMode::None;
        bake.source.emplace(BakedSource{
            m_view.header->source_hash, reducedFacts(m_view.manifest, reductionText(m_report, m_target)), {}});
        bake.verify = [&](const std::string& path) {
            if (last) // all of `source` has been read
                m_model.reset();
            measureFile(path);
        };
        (void)bakeFrom(checkpoint, source, bake, [](const char*, uint64_t, uint64_t) {});
    }

    // The file before it has its name.
    void measureFile(const std::string& path)
    {
        const IssueSink sink = throwFirstIssue(m_output);
        const GscFile file(path, sink);
        GscView view;
        openGsc(file.bytes(), view, GscCheck::Full, sink);
        file.letGo(file.bytes());
        m_report.after = {file.bytes().size(), archiveSize(file, view, m_options.threads)};
        if (m_options.max_bytes > 0 && m_report.after.archive.file > m_options.max_bytes)
            throw Error(ErrorCode::Difference,
                        formatString("%s: its archive would have %llu bytes, expected at most %llu of --max-bytes; "
                                     "nothing was written, pass a lower --target-psnr or more bytes",
                                     m_output.c_str(), (unsigned long long)m_report.after.archive.file,
                                     (unsigned long long)m_options.max_bytes));
    }

    ReduceOptions m_options;
    const ReduceProgress& m_progress;
    Workers m_workers;
    std::shared_ptr<const GscFile> m_file;
    GscView m_view;
    std::shared_ptr<const Scene> m_scene;
    PoseSets m_poses;
    std::optional<Importance> m_importance;
    std::vector<std::byte> m_weights, m_packed; // networks in halves
    std::optional<ReducedModel> m_model;
    std::optional<PictureProbe> m_probe; // goes before what its renderer has loaded
    std::vector<uint32_t> m_order;       // of the anchors in a file that is written
    std::string m_output;                // of the bake that is under way
    std::optional<double> m_target;
    uint64_t m_weight_pixels = 0;
    double m_margin = kSearchMargin;
    uint64_t m_drawn = 0, m_pictures = 0;
    ReduceReport m_prepared, m_report;
};

Reducer::Reducer(const ReduceOptions& options, const ReduceProgress& progress, size_t bakes)
    : m_state(std::make_unique<State>(options, progress))
{
    m_state->prepare(bakes);
}

Reducer::~Reducer() = default;

ReduceReport Reducer::bakeTo(const std::string& output, std::optional<double> target, std::optional<double> min_view,
                             bool last)
{
    return m_state->bakeTo(output, target, min_view, last);
}

FileScore Reducer::measure(const std::string& path)
{
    return m_state->measure(path);
}

const ReduceReport& Reducer::prepared() const
{
    return m_state->prepared();
}

ReduceReport reduce(const ReduceOptions& options, const ReduceProgress& progress)
{
    return Reducer(options, progress, 1).bakeTo(options.output, options.target_psnr, options.min_view_psnr, true);
}

std::vector<int64_t> leverShares(const ReduceReport& report)
{
    std::vector<int64_t> shares(kLevers, 0);
    const StoredBytes &before = report.before.archive, &after = report.after.archive;
    const double stay = 1 - double(report.anchors_left_out) / double(report.anchors);
    // what is left out takes its part of every array with it, at what that took of the source
    const double offsets = stay * double(before.offsets);
    const double kept_slots = stay * double(report.slots);
    const double masked = kept_slots > 0 ? offsets * double(report.slots_masked) / kept_slots : 0;
    const auto set = [&](Lever lever, double bytes) {
        shares[size_t(std::countr_zero(uint32_t(lever)))] += int64_t(std::llround(bytes));
    };
    // steps are those of the lever that makes them coarser still, where there is one
    const auto steps = [&](Lever lever) {
        return (report.levers & kLeverCompact) && !(report.levers & lever) ? kLeverCompact : lever;
    };
    set(kLeverAnchors, (1 - stay) * double(before.anchors()));
    set(kLeverSlots, masked);
    set(steps(kLeverOffsets), offsets - masked - double(after.offsets));
    set(steps(kLeverFeatures), stay * double(before.features) - double(after.features));
    set(kLeverScales, stay * double(before.scales) - double(after.scales));
    set(kLeverOrder, stay * double(before.positions) - double(after.positions));
    set(kLeverNetworks, double(before.networks) - double(after.networks));
    return shares;
}

} // namespace gsc
