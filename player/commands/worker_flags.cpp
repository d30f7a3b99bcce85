// SPDX-License-Identifier: Apache-2.0
#include "player/commands/worker_flags.h"

#include <gsc/error.h>
#include "player/commands/render_options.h"
#include "player/devices/worker_options.h"
#include "runtime/backend/frame_checks.h"
#include "runtime/cli/options.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace gsc {

namespace {

constexpr size_t kMostWorkers = 64;
constexpr double kMostFps = 100000;

// Splits a text at commas; empty words are kept.
std::vector<std::string> wordsOf(const std::string& text)
{
    std::vector<std::string> words{""};
    for (const char c : text)
        c == ',' ? words.emplace_back() : words.back() += c;
    return words;
}

bool wholeNumber(const std::string& text, int& value)
{
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    return code == std::errc() && end == text.data() + text.size() && value >= 0;
}

// Parses a device such as "cuda:1", "cuda" or "cpu"; returns none for anything else.
std::optional<DeviceId> deviceOf(const std::string& text)
{
    const size_t colon = text.find(':');
    DeviceId id{text.substr(0, colon), 0};
    if (id.backend != "cuda" && id.backend != "cpu" && id.backend != "cpu-reference")
        return std::nullopt;
    if (colon != std::string::npos && !wholeNumber(text.substr(colon + 1), id.ordinal))
        return std::nullopt;
    return id;
}

std::vector<DeviceId> parseDevices(const std::string& name, const std::string& text)
{
    std::vector<DeviceId> ids;
    for (const std::string& word : wordsOf(text)) {
        const std::optional<DeviceId> id = deviceOf(word);
        if (!id)
            detail::failValue(name, text, "no device", "names such as cuda:0,cuda:2 (gsc-play --list-devices)");
        ids.push_back(*id);
    }
    return ids;
}

// Parses the value of --gpus: "2", "all" or "cpu:4".
WorkerCount parseGpus(const std::string& name, const std::string& text)
{
    WorkerCount count;
    count.given = true;
    count.on_cpu = text.starts_with("cpu:");
    count.all = text == "all";
    int number = 0;
    if (!count.all &&
        (!wholeNumber(count.on_cpu ? text.substr(4) : text, number) || number < 1 || size_t(number) > kMostWorkers))
        detail::failValue(name, text, "no number of devices", "a number, all, or cpu:N for N workers on the CPU");
    count.number = uint32_t(number);
    return count;
}

// Parses the value of --inject: "throw:0.01,hang:0.001,hang-ms:500,seed:7,device:cuda:1".
Faults parseFaults(const std::string& name, const std::string& text)
{
    Faults faults;
    const std::pair<const char*, double*> chances[] = {
        {"throw", &faults.throws}, {"hang", &faults.hangs}, {"lost", &faults.lost}, {"memory", &faults.memory}};
    for (const std::string& word : wordsOf(text)) {
        const size_t colon = std::min(word.find(':'), word.size());
        const std::string key = word.substr(0, colon), value = word.substr(std::min(colon + 1, word.size()));
        const auto chance = std::ranges::find(chances, key, &std::pair<const char*, double*>::first);
        if (chance != std::end(chances)) {
            *chance->second = detail::number(name, value, {0, 1}, "");
        } else if (key == "hang-ms") {
            faults.hang = std::chrono::milliseconds(detail::wholeNumber(name, value, 1, 3600000));
        } else if (key == "slow-ms") {
            faults.slow = std::chrono::milliseconds(detail::wholeNumber(name, value, 1, 3600000));
        } else if (key == "seed") {
            faults.seed = uint64_t(detail::wholeNumber(name, value, 0, int64_t(1) << 40));
        } else if (key == "device" && deviceOf(value)) {
            faults.device = deviceOf(value);
        } else {
            detail::failValue(
                name, text, "no fault",
                "throw, hang, lost or memory with a chance such as lost:0.01, and hang-ms, slow-ms, seed or device");
        }
    }
    return faults;
}

} // namespace

void addWorkerOptions(CLI::App& app, PlayOptions& options)
{
    const Heading heading(app, "Devices that draw together");
    WorkerOptions& workers = options.devices.workers;
    const OptionHandle gpus = detail::addValue(
        app, "--gpus", "N|all|cpu:N (default: one device)",
        "number of devices that draw together: N GPUs, all GPUs, or N workers on the CPU",
        [&workers](const std::string& name, const std::string& text) { workers.count = parseGpus(name, text); });
    const OptionHandle chosen =
        detail::addValue(app, "--devices", "LIST",
                         "devices that draw together, such as cuda:0,cuda:2; the first gathers the pictures",
                         [&workers](const std::string& name, const std::string& text) {
                             workers.devices = parseDevices(name, text);
                         })
            .rare();
    chosen.excludes(gpus);
    for (const OptionHandle& option : {gpus, chosen}) {
        option.excludes(optionOf(app, "--backend"));
        option.excludes(optionOf(app, "--device"));
    }
    addChoice<ServiceMode>(app, "--mode", workers.mode,
                           {{"auto", ServiceMode::Auto},
                            {"frame", ServiceMode::Frame},
                            {"eye", ServiceMode::Eye},
                            {"split", ServiceMode::Split}},
                           "default: auto",
                           "sharing of the work: frame: devices take frames in turn; eye: each draws one eye; split: "
                           "each draws a band of the image; auto: the fastest by measurement: least latency among "
                           "those that reach --min-fps, or most frames per second without it")
        .rare();
    addNumber(app, "--min-fps", workers.min_fps, {0, kMostFps}, " frames per second", "FPS (default: 0)",
              "start a further device when frames per second fall, or are about to fall, below this; 0 = all draw from "
              "the start")
        .rare();
    addNumber(app, "--max-fps", workers.max_fps, {0, kMostFps}, " frames per second", "FPS (default: 0)",
              "stop a device when frames per second exceed (1 + 1/N) times this, N being the devices that remain; 0 = "
              "none stops")
        .rare();
    detail::addValue(
        app, "--inject", "KIND:CHANCE,...",
        "cause faults, for tests: throw, hang, lost or memory, each with its chance per frame (0 to 1); hang-ms:N: "
        "length of a hang; slow-ms:N: delay of every frame; seed:N: of the chances; device:cuda:1: only there",
        [&workers](const std::string& name, const std::string& text) { workers.faults = parseFaults(name, text); })
        .rare();
}

void checkWorkerOptions(const CLI::App& app, const PlayOptions& options, bool sweeps)
{
    const WorkerOptions& workers = options.devices.workers;
    for (const char* option : {"--mode", "--min-fps", "--max-fps", "--inject"})
        checkEffect(app, option, drawsWithService(options.devices), "--gpus or --devices");
    for (const char* option : {"--gpus", "--devices", "--device"})
        if (remoteWorkers() != nullptr && isGiven(app, option))
            throw Error(ErrorCode::Usage, option, "the ranks of an MPI job are its devices", "it left out",
                        "say with mpirun -n N how many");
    if (options.devices.first_picture && drawsWithService(options.devices))
        throw Error(ErrorCode::Usage, "--first-picture",
                    "several devices load each at its own pace and would show now more, now less", "one device",
                    "leave --first-picture or the others out");
    if (workers.max_fps > 0 && workers.max_fps < workers.min_fps)
        throw Error(ErrorCode::Usage, formatString("--max-fps %g", workers.max_fps),
                    formatString("below --min-fps %g", workers.min_fps), "at least that", "raise it or leave it out");
    if (workers.mode == ServiceMode::Eye && options.view.eyes != 2)
        throw Error(ErrorCode::Usage, "--mode eye", "with one eye", "--eyes 2", "pass that too or take another mode");
    if (workers.mode == ServiceMode::Eye && options.frame.stereo == StereoMode::Merged)
        throw Error(ErrorCode::Usage, "--mode eye", "together with --stereo merged, which decodes once for both eyes",
                    "one of them", "take --mode split or frame");
    if (!sweeps && options.frame.reuse.policy == ReusePolicy::Error && drawsOnGpu(options.devices))
        checkReuse("cuda", options.frame.reuse.policy);
}

} // namespace gsc
