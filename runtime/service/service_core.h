// SPDX-License-Identifier: Apache-2.0
// What a renderer service and its threads share. One mutex guards all of it; renderers are used outside of it, each by the
// thread of its worker alone.
#pragma once

#include "runtime/service/bands.h"
#include "runtime/service/frame_cost.h"
#include "runtime/device_pictures.h"
#include "runtime/service/renderer_service.h"

#include <condition_variable>
#include <mutex>
#include <thread>
#include <unordered_map>

namespace gsc {

// A pose from submit() until it has ended.
struct PoseWork {
    EyeParams eyes[kMaxEyes] = {};
    uint32_t eye_count = 0;
    FrameOptions options;
    PixelFormat format = PixelFormat::Rgba8;
    bool wants_depth = false, on_device = false;

    struct Late { // PoseRequest::late, and what it found
        std::function<bool(std::span<EyeParams>)> look;
        std::once_flag looked;
        EyeParams eyes[kMaxEyes] = {};
        bool found = false;
    };
    std::shared_ptr<Late> late; // also of the copy that is drawn anew; null: the eyes stay

    ServiceTime submitted{0}, drawn{0};
    std::optional<ServiceTime> begun;
    SharePlan plan; // that it was begun by
    uint64_t plan_serial = 0;

    // Picture of each eye, then its depths, in one block.
    std::shared_ptr<std::byte> memory;
    std::shared_ptr<PictureMemory> pictures; // that it is of
    size_t pixels_at[kMaxEyes] = {}, depths_at[kMaxEyes] = {}, bytes = 0;

    struct Part {
        PosePart what;
        int worker = -1;
        double busy_ms = 0;
        FrameResult result;
    };
    std::vector<Part> parts;
    bool again = false; // after a fault
    bool first = false; // a part is among the first that its renderer drew, whose buffers grow

    void layOut();
    // Where its eyes are drawn from: looks late, once for all parts. Called without the core's mutex.
    [[nodiscard]] std::span<const EyeParams> latestEyes() const;
    [[nodiscard]] FrameResult result() const; // of parts that were drawn side by side: one of all
    // Are its eyes all so near to those of `other` (world units, degrees) that they show the same, of the same options?
    [[nodiscard]] bool showsSameAs(const PoseWork& other, double distance, double degrees) const;
    // What an eye's picture is drawn into, in a block of memory such as `memory`.
    [[nodiscard]] FrameTarget target(uint32_t eye, FrameTarget::Kind kind, std::byte* block) const;
};

// A part that a renderer is drawing.
struct PartInFlight {
    Job job;
    std::shared_ptr<PoseWork> work;
    PosePart part;
    uint32_t slot = 0; // of the bridge
    bool bridged = false;
    std::shared_ptr<PictureBridge> bridge; // that it is brought home by
    std::vector<EyeParams> eyes;
    std::vector<FrameTarget> targets;
    FrameOptions options;
    uint64_t ticket = 0;
    ServiceTime since{0}; // taken

    [[nodiscard]] FrameRequest request() const { return {eyes, targets, options}; }
};

struct Worker {
    Worker(int number, DeviceId id) : index(number), device(std::move(id)) {}

    const int index;
    const DeviceId device;

    // Guarded by the core's mutex.
    WorkerState state = WorkerState::Cold;
    enum class Order { Rest, Hold, Work } order = Order::Rest; // no renderer; one that has the model; draw
    bool abandoned = false;                                    // it hangs: another takes its place
    std::optional<ServiceTime> in_call;                        // into the renderer, since when
    ServiceTime returns{0};                                    // of state Retired
    ServiceTime busy_until{0};                                 // end of the part drawn last
    uint64_t dropped = 0;                                      // of the core's m_drops that it has followed
    std::vector<Job> jobs;                                     // that it is drawing
    uint32_t faults_in_a_row = 0;
    std::exception_ptr fault; // the last
    uint32_t drawn = 0;       // parts, by the renderer that it has now
    bool finished = false;    // its thread is about to end
    WorkerStats stats;

    // Of its thread alone.
    std::unique_ptr<Renderer> renderer;
    std::shared_ptr<PictureBridge> bridge;
    std::shared_ptr<PictureMemory> bridge_to;
    std::thread thread;
};

// Is it what was asked for that cannot be drawn, by any worker?
bool isOfRequest(const std::exception_ptr& error);

class RendererService::Core : public std::enable_shared_from_this<Core> {
public:
    Core(std::shared_ptr<const Scene> scene, const ModelView& model, const ServiceOptions& options);

    void start(); // after the constructor, of an object that a shared_ptr holds
    void stop();

    uint64_t submit(const PoseRequest& request);
    std::optional<Delivery> next(std::chrono::nanoseconds most);
    void giveMemoryBack();
    void setPace(double min_fps, double max_fps);
    void dropCaches();
    ServiceStats stats() const;
    ServiceTrace trace() const;
    DeviceFacts device() const;
    Tier tierOf(Tier asked) const;
    [[nodiscard]] ServiceTime now() const { return std::chrono::steady_clock::now() - m_from; }

private:
    using Lock = std::unique_lock<std::mutex>;
    using WorkerPtr = std::shared_ptr<Worker>;

    // service_worker.cpp: of a worker's thread
    void run(const WorkerPtr& worker);
    void makeReady(const WorkerPtr& worker, Lock& lock);
    bool serve(const WorkerPtr& worker, Lock& lock, std::deque<PartInFlight>& flying);
    bool beginPart(Worker& worker, Lock& lock, std::deque<PartInFlight>& flying);
    void endPart(Worker& worker, Lock& lock, std::deque<PartInFlight>& flying);
    void prepare(Worker& worker, PartInFlight& part, bool stale);
    void makePictures(const Worker& worker);
    void takeMemory(Worker& worker, Lock& lock, PoseWork& work);
    void forgetLost(Worker& worker, Lock& lock);
    void failRequest(Worker& worker, const Job& job);
    void land(const PartInFlight& part);
    void retire(const WorkerPtr& worker, const std::exception_ptr& error);
    template <typename Call>
    auto calling(Worker& worker, Lock& lock, const Call& call);

    // service_core.cpp: of whoever holds the mutex
    [[nodiscard]] ServiceTime returnOf(const Worker& worker) const;
    void launch(const WorkerPtr& worker);
    void keep(); // the keeper's thread
    void lookAtPace();
    void lookForHangs();
    [[nodiscard]] std::vector<int> working() const;
    [[nodiscard]] bool othersRest(const Worker& worker, size_t sharing) const;
    [[nodiscard]] SharePlan planFor(const PoseWork& work);
    std::optional<Job> take(Worker& worker, size_t flying);
    void begin(uint64_t pose, PoseWork& work, const std::vector<int>& sharing);
    void noteDrawn(uint64_t pose, const std::shared_ptr<PoseWork>& work);
    void settle();                                                  // what has ended
    void giveBack(Worker& worker, const std::exception_ptr& error); // what it draws
    void abandon(size_t index, ServiceTime deadline);
    void order(Worker& worker, Worker::Order order, const std::string& cause);
    void note(TraceEvent::Kind kind, int worker, const std::string& cause);
    [[nodiscard]] double measuredRate() const;
    [[nodiscard]] double paceRate() const;
    [[nodiscard]] double foreseen(double rate) const;
    [[nodiscard]] bool allGone() const;
    [[nodiscard]] size_t partsAhead() const { return m_options.keeps_all && m_choice.decided() ? kFramesInFlight : 1; }
    [[nodiscard]] bool isStill(const PoseWork& work) const;

    const ServiceOptions m_options;
    const std::shared_ptr<const Scene> m_scene;
    const ModelView m_model;
    const std::chrono::steady_clock::time_point m_from = std::chrono::steady_clock::now();

    mutable std::mutex m_mutex; // guards what follows
    std::condition_variable m_work, m_done, m_kept;
    PoseLedger m_ledger;
    std::unordered_map<uint64_t, std::shared_ptr<PoseWork>> m_poses; // open
    std::vector<WorkerPtr> m_workers, m_abandoned;
    std::shared_ptr<PictureMemory> m_pictures[2]; // of the host, of the first worker's device; made with the first
    Pace m_pace;
    PaceRules m_rules;
    ModeChoice m_choice;
    std::vector<SharePlan> m_tried; // by m_choice
    uint64_t m_tried_shape = 0;     // of the poses that they were tried with
    ServiceTime m_tried_at{0};
    BandBalance m_bands;
    FrameCost m_cost;
    double m_span_ms = 0;             // that a frame takes the worker that takes longest: a running mean,
    SharePlan m_span_plan;            // of frames by this plan alone
    std::shared_ptr<PoseWork> m_last; // accepted
    uint64_t m_last_pose = 0;
    PoseEnd m_last_end = PoseEnd::Shown;
    bool m_last_partial = false; // it shows some of the model only
    uint64_t m_drops = 0;
    uint64_t m_still = 0;
    LatencyCounts m_latency;
    ServiceTrace m_trace;
    std::exception_ptr m_error; // the last fault
    std::optional<DeviceFacts> m_facts;
    Tier m_tier_exact = Tier::Exact, m_tier_fast = Tier::Fast;
    bool m_stopping = false;
    std::thread m_keeper;
};

} // namespace gsc
