// SPDX-License-Identifier: Apache-2.0
// Hostile numbers and broken surroundings: a clear error, nothing left behind.
#include "convert/compare/compare_checkpoint.h"
#include "convert/write/anchor_check.h"
#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "tests/support/in_child.h"
#include "tests/write/memory_model.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace gsc;
using namespace gsc::test;

namespace {

// Writes into an empty folder, expects an error, and that the folder stays empty. Returns the message.
std::string failToBake(const MemoryModel& model, MemorySource& source, ErrorCode code, WriteOptions options = {})
{
    const TemporaryFolder folder;
    options.output = folder / "model.gsc";
    std::string message;
    const Outcome refused = outcomeOf([&] { writeGscFrom(model.checkpoint, source, options, {}); });
    message = refused.message;
    CHECK(refused.code == code);
    CHECK(folder.names().empty());
    return message;
}

std::string failToBake(const MemoryModel& model, ErrorCode code)
{
    MemorySource source(model);
    return failToBake(model, source, code);
}

int writeStatus(const MemoryModel& model, MemorySource& source, const std::string& output)
{
    try {
        WriteOptions options;
        options.output = output;
        options.threads = 1; // a forked child has no other threads to inherit
        writeGscFrom(model.checkpoint, source, options, {});
        return 0;
    } catch (const Error& error) {
        return int(error.code());
    }
}

struct Fault {
    const char* name;
    std::function<void(AnchorBatch&)> apply;
};

} // namespace

TEST_CASE("trap 18, trap 19: anchors that cannot be shown are refused with their number, or dropped on request")
{
    const Fault faults[] = {
        {"NaN position", [](AnchorBatch& b) { b.position[3 * 17 + 1] = NAN; }},
        {"infinite position", [](AnchorBatch& b) { b.position[3 * 17] = INFINITY; }},
        {"NaN anchor scale", [](AnchorBatch& b) { b.scale[6 * 17 + 2] = NAN; }},
        {"NaN gaussian scale", [](AnchorBatch& b) { b.scale[6 * 17 + 5] = NAN; }},
        {"infinite scale", [](AnchorBatch& b) { b.scale[6 * 17 + 4] = INFINITY; }},
        {"overflowing scale", [](AnchorBatch& b) { b.scale[6 * 17 + 3] = 89; }},
        {"overflowing covariance", [](AnchorBatch& b) { b.scale[6 * 17 + 3] = 45; }},
        {"NaN feature", [](AnchorBatch& b) { b.feature[8 * 17 + 7] = NAN; }},
        {"infinite offset", [](AnchorBatch& b) { b.offset[9 * 17 + 8] = -INFINITY; }},
        {"overflowing offset",
         [](AnchorBatch& b) {
             b.offset[9 * 17 + 3] = 3e38f;
             b.scale[6 * 17] = 20;
         }},
        {"NaN level bias", [](AnchorBatch& b) { b.extra_level[17] = NAN; }},
        {"NaN rotation", [](AnchorBatch& b) { b.rotation[4 * 17 + 3] = NAN; }},
        {"position out of reach", [](AnchorBatch& b) { b.position[3 * 17] = 3e38f; }},
    };
    ModelShape shape;
    shape.anchors = 300;
    for (const Fault& fault : faults) {
        CAPTURE(fault.name);
        MemoryModel model = makeModel(shape);
        fault.apply(model.anchors);
        const std::string message = failToBake(model, ErrorCode::InvalidFile);
        INFO(message);
        CHECK(message.find("1 of 300 anchors cannot be shown: 1 with ") != std::string::npos);
        CHECK(message.find("(first: anchor 17)") != std::string::npos);
        CHECK(message.find("--drop-invalid") != std::string::npos);

        WriteOptions options;
        options.drop_invalid = true;
        const Written written = writeModel(model, options);
        CHECK(written.report.anchors == 299);
        CHECK(written.report.dropped == 1);
        REQUIRE(written.report.warnings.size() == 1);
        CHECK(written.report.warnings[0].find("1 of 300 anchors were left out") == 0);
        MemorySource source(model);
        const CompareReport report = compareCheckpoint(model.checkpoint, source, written.view, {});
        INFO(report.summary());
        CHECK(report.equal);
        CHECK(report.dropped == 1);

        // exactly the file of a model without that anchor, but for what says where it came from
        MemoryModel without = model;
        without.removeAnchor(17);
        const Written clean = writeModel(without, options);
        REQUIRE(clean.view.anchors.size() == written.view.anchors.size());
        CHECK(std::equal(clean.view.anchors.begin(), clean.view.anchors.end(), written.view.anchors.begin()));
        CHECK(std::equal(clean.view.index.begin(), clean.view.index.end(), written.view.index.begin()));
    }
}

TEST_CASE("the largest scales, positions and offsets that can be shown are taken, the next larger ones are not")
{
    ModelShape shape;
    shape.anchors = 1;
    const AnchorBatch good = makeModel(shape).anchors;
    const auto faultOf = [&](const std::function<void(AnchorBatch&)>& change) {
        AnchorBatch batch = good;
        change(batch);
        return findAnchorFault(batch, 0, shape.feat_dim, shape.n_offsets, false);
    };
    CHECK(faultOf([](AnchorBatch&) {}) == AnchorFault::None);
    for (size_t c = 0; c < 6; ++c) {
        const auto scale = [c](float value) { return [c, value](AnchorBatch& b) { b.scale[c] = value; }; };
        CHECK(faultOf(scale(44)) == AnchorFault::None);
        CHECK(faultOf(scale(44.5f)) == AnchorFault::HugeScale);
    }
    for (size_t axis = 0; axis < 3; ++axis) {
        const auto position = [axis](float value) {
            return [axis, value](AnchorBatch& b) { b.position[axis] = value; };
        };
        CHECK(faultOf(position(1e30f)) == AnchorFault::None);
        CHECK(faultOf(position(-1.001e30f)) == AnchorFault::OutOfReach);
        // an offset is multiplied by the exponential of its scale: up to 1e30
        const auto offset = [axis](float value, float scale) {
            return [axis, value, scale](AnchorBatch& b) {
                b.offset[3 + axis] = value;
                b.scale[axis] = scale;
            };
        };
        CHECK(faultOf(offset(0.9e20f, 23)) == AnchorFault::None);
        CHECK(faultOf(offset(-1.1e20f, 23.1f)) == AnchorFault::HugeOffset);
        CHECK(faultOf(offset(1e11f, 43)) == AnchorFault::None);
        CHECK(faultOf(offset(1e11f, 43.9f)) == AnchorFault::HugeOffset);
    }
}

TEST_CASE("a refused model does not wait for its checksum")
{
    const TemporaryFolder folder;
    ModelShape shape;
    shape.anchors = 300;
    MemoryModel model = makeModel(shape);
    model.anchors.position[5] = NAN;
    model.checkpoint.ply_path = folder / "point_cloud.ply";
    std::ofstream(model.checkpoint.ply_path) << "ply";
    std::filesystem::resize_file(model.checkpoint.ply_path, uint64_t(1) << 36); // all holes; half a minute to read
    const auto start = std::chrono::steady_clock::now();
    failToBake(model, ErrorCode::InvalidFile);
    CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(5));
}

TEST_CASE("a source that became a pipe is refused, not waited for")
{
    const TemporaryFolder folder;
    ModelShape shape;
    shape.anchors = 300;
    MemoryModel model = makeModel(shape);
    model.checkpoint.ply_path = folder / "point_cloud.ply";
    REQUIRE(::mkfifo(model.checkpoint.ply_path.c_str(), 0600) == 0);
    CHECK(failToBake(model, ErrorCode::Io).find("no regular file") != std::string::npos);
}

TEST_CASE("what never renders may hold anything")
{
    ModelShape shape;
    shape.anchors = 40;
    MemoryModel model = makeModel(shape);
    model.anchors.scale[3] = 43.9f; // large, finite
    CHECK(writeModel(model).report.anchors == 40);
}

TEST_CASE("a model without an anchor that can be shown is refused, even when dropping")
{
    ModelShape shape;
    shape.anchors = 5;
    MemoryModel model = makeModel(shape);
    for (float& p : model.anchors.position)
        p = NAN;
    MemorySource source(model);
    WriteOptions options;
    options.drop_invalid = true;
    CHECK(failToBake(model, source, ErrorCode::InvalidFile, options).find("no anchor that can be shown") !=
          std::string::npos);
    model.checkpoint.anchor_count = 0;
    failToBake(model, ErrorCode::InvalidFile);
}

TEST_CASE("a model may have as many levels as the format, and no more")
{
    for (const int32_t levels : {int32_t(kMaxLevels), int32_t(kMaxLevels) + 1}) {
        ModelShape shape;
        shape.anchors = 2 * uint64_t(levels);
        shape.levels = 2;
        MemoryModel model = makeModel(shape);
        for (size_t i = 0; i < model.anchors.count; ++i)
            model.anchors.level[i] = int32_t(i) % levels;
        if (levels == int32_t(kMaxLevels))
            CHECK(writeModel(model).view.levels.size() == kMaxLevels);
        else
            CHECK(failToBake(model, ErrorCode::InvalidFile).find("has anchors on 65 levels, expected at most 64") !=
                  std::string::npos);
    }
}

TEST_CASE("a source that is shorter than it said, fails or changes leaves no file")
{
    ModelShape shape;
    shape.anchors = 3000;
    const MemoryModel model = makeModel(shape);
    MemorySource shorter(model);
    shorter.rows = 2999;
    CHECK(failToBake(model, shorter, ErrorCode::InvalidFile).find("holds 2,999 anchors, expected 3,000") !=
          std::string::npos);
    for (const int passes : {0, 1})
        for (const uint64_t row : {0, 1500, 2999}) {
            MemorySource broken(model);
            broken.fail_at = row;
            broken.passes_before_failure = passes;
            CHECK(failToBake(model, broken, ErrorCode::Io) == "memory: the source broke, expected more rows; mend it");
        }
}

TEST_CASE("an existing file is kept unless overwriting was asked for")
{
    ModelShape shape;
    shape.anchors = 20;
    const MemoryModel model = makeModel(shape);
    const TemporaryFolder folder;
    WriteOptions options;
    options.output = folder / "model.gsc";
    std::ofstream(options.output) << "precious";
    MemorySource source(model);
    source.fail_at = 0; // refused before a row is read
    const Outcome refused = outcomeOf([&] { writeGscFrom(model.checkpoint, source, options, {}); });
    CHECK(refused.code == ErrorCode::Io);
    CHECK(refused.says("already exists"));
    CHECK(std::filesystem::file_size(options.output) == 8);
    CHECK(folder.names().size() == 1);
    options.overwrite = true;
    source.fail_at = UINT64_MAX;
    // a file that is not what it should be never replaces one
    options.verify = [&](const std::string& path) {
        CHECK(path != options.output);
        openWritten(path);
        CHECK(std::filesystem::file_size(options.output) == 8);
        throw Error(ErrorCode::Internal, "file", "found to differ", "the same", "write it again");
    };
    CHECK_THROWS_AS(writeGscFrom(model.checkpoint, source, options, {}), Error);
    CHECK(std::filesystem::file_size(options.output) == 8);
    CHECK(folder.names().size() == 1);
    options.verify = nullptr;
    writeGscFrom(model.checkpoint, source, options, {});
    openWritten(options.output);
}

TEST_CASE("ctrl-c while reading leaves no file behind")
{
    ModelShape shape;
    shape.anchors = 3000;
    const MemoryModel model = makeModel(shape);
    for (const int passes : {0, 1}) {
        const TemporaryFolder folder;
        const int status = inChild([&] {
            installInterruptHandler();
            MemorySource source(model);
            source.interrupt_at = 1000;
            source.passes_before_failure = passes;
            return writeStatus(model, source, folder / "model.gsc");
        });
        CHECK(status == int(ErrorCode::Interrupted));
        CHECK(folder.names().empty());
    }
}

TEST_CASE("a full disk leaves no file behind")
{
    ModelShape shape;
    shape.anchors = 3000;
    const MemoryModel model = makeModel(shape);
    // a limit on the size of files stands in for the disk: too small for the anchors, then for what follows them
    const uint64_t whole = writeModel(model).report.output_bytes;
    for (const uint64_t limit : {uint64_t(10'000), whole / 2, whole - 4096}) {
        const TemporaryFolder folder;
        const int status = inChild([&] {
            std::signal(SIGXFSZ, SIG_IGN);
            const rlimit size{limit, limit};
            if (::setrlimit(RLIMIT_FSIZE, &size) != 0)
                return 99;
            MemorySource source(model);
            return writeStatus(model, source, folder / "model.gsc");
        });
        CHECK(status == int(ErrorCode::Io));
        CHECK(folder.names().empty());
    }
}

TEST_CASE("progress ascends, is told from the caller's thread and ends at its total")
{
    ModelShape shape;
    shape.anchors = 9000;
    const MemoryModel model = makeModel(shape);
    const TemporaryFolder folder;
    WriteOptions options;
    options.output = folder / "model.gsc";
    options.threads = 1;
    MemorySource source(model);
    std::string stages, last_stage;
    uint64_t last = 0, last_total = 0;
    writeGscFrom(model.checkpoint, source, options, [&](const char* stage, uint64_t done, uint64_t total) {
        if (last_stage != stage) {
            CHECK(last == last_total);
            stages.append(stage).append(" ");
            last_stage = stage;
            last = 0;
        }
        CHECK(done >= last);
        CHECK(done <= total);
        last = done;
        last_total = total;
    });
    CHECK(stages == "scan grid distribute chunks index ");
}
