// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"
#include "convert/commands/export/export_gaussians.h"
#include "convert/commands/manifest_check.h"
#include "convert/compare/compare_render.h"
#include "convert/sample/sample.h"
#include "convert/write/write_gsc.h"
#include <gsc/file/output_file.h>
#include <gsc/file/read_file.h>
#include "runtime/cli/quantity.h"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace gsc;

TEST_CASE("parseByteSize: binary units, rounded down")
{
    CHECK(parseByteSize("4096") == 4096u);
    CHECK(parseByteSize("8G") == uint64_t(8) << 30);
    CHECK(parseByteSize("8g") == uint64_t(8) << 30);
    CHECK(parseByteSize("1.5 GiB") == uint64_t(3) << 29);
    CHECK(parseByteSize("512MB") == uint64_t(512) << 20);
    CHECK(parseByteSize("2T") == uint64_t(2) << 40);
    CHECK(parseByteSize("0") == 0u);
    CHECK(parseByteSize("1.0001K") == 1024u);
    CHECK(parseByteSize("16777215T") == uint64_t(16777215) << 40);
    for (const char* bad : {"", "G", ".", "-1", "8Q", "8GG", "1e9", "0x10", "16777216T", "99999999999999999999", " 8G"})
        CHECK_MESSAGE(!parseByteSize(bad), bad);
}

TEST_CASE("checkManifest: META that is no JSON is issue 3002, and only then")
{
    GscView view;
    std::vector<uint16_t> ids;
    const IssueSink sink = [&](const Issue& issue) { ids.push_back(issue.info->id); };
    view.manifest = R"({"model": [1, 2, {"a": null}]})";
    checkManifest(view, sink);
    CHECK(ids.empty());
    for (const char* bad : {"{", R"({"a": 1,})", "{\"a\": NaN}", "{} {}"}) {
        CAPTURE(bad);
        ids.clear();
        view.manifest = bad;
        checkManifest(view, sink);
        CHECK(ids == std::vector<uint16_t>{3002});
    }
}

TEST_CASE("parseCount: decimal units, whole numbers only")
{
    CHECK(parseCount("1300000") == 1'300'000u);
    CHECK(parseCount("18.5M") == 18'500'000u);
    CHECK(parseCount("20k") == 20'000u);
    CHECK(parseCount("1.234567M") == 1'234'567u);
    for (const char* bad : {"", "1.5", "1.2345k", "20Ki", "20kB", "M", "-3"})
        CHECK_MESSAGE(!parseCount(bad), bad);
}

TEST_CASE("formatBytes and formatCount")
{
    CHECK(formatBytes(0) == "0 B");
    CHECK(formatBytes(1023) == "1023 B");
    CHECK(formatBytes(1536) == "1.50 KiB");
    CHECK(formatBytes(uint64_t(59) << 20) == "59.0 MiB");
    CHECK(formatBytes(UINT64_MAX) == "16.0 EiB");
    CHECK(formatCount(0) == "0");
    CHECK(formatCount(999) == "999");
    CHECK(formatCount(1000) == "1,000");
    CHECK(formatCount(18'500'000) == "18,500,000");
}

TEST_CASE("jsonNumber and jsonText: what JSON cannot hold never gets out")
{
    CHECK(jsonNumber(1.5).dump() == "1.5");
    CHECK(jsonNumber(std::numeric_limits<double>::infinity()).is_null());
    CHECK(jsonNumber(std::nan("")).is_null());
    const Json latin1 = {{"path", "caf\xe9"}}; // a file name need not be UTF-8
    CHECK(Json::parse(jsonText(latin1))["path"] == "caf\xef\xbf\xbd");
}

TEST_CASE("runInvocation turns every exception into its exit code")
{
    Invocation invocation;
    invocation.reporter.progress = ProgressMode::None;
    for (const ErrorCode code :
         {ErrorCode::Usage, ErrorCode::Io, ErrorCode::InvalidFile, ErrorCode::Internal, ErrorCode::Unsupported,
          ErrorCode::OutOfMemory, ErrorCode::Device, ErrorCode::Difference, ErrorCode::Interrupted}) {
        invocation.run = [code](Reporter&) -> ErrorCode {
            throw Error(code, "x", "thrown by a test", "none", "go on");
        };
        CHECK(runInvocation(invocation) == code);
        invocation.run = [code](Reporter&) { return code; };
        CHECK(runInvocation(invocation) == code);
    }
    invocation.run = [](Reporter&) -> ErrorCode { throw std::bad_alloc(); };
    CHECK(runInvocation(invocation) == ErrorCode::OutOfMemory);
    invocation.run = [](Reporter&) -> ErrorCode { throw std::length_error("thrown by a test"); };
    CHECK(runInvocation(invocation) == ErrorCode::Internal);
    invocation.run = [](Reporter&) -> ErrorCode { throw 7; };
    CHECK(runInvocation(invocation) == ErrorCode::Internal);
}

TEST_CASE("readInputText reads a file whole, and no more than it may")
{
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / ("gsc-commands-test-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    writeTextFile((folder / "a").string(), "one\ntwo", false);
    CHECK(readInputText((folder / "a").string(), 7, "text") == "one\ntwo");
    CHECK_THROWS_AS(readInputText((folder / "a").string(), 6, "text"), Error);
    const auto opened = [] { return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()); };
    const auto before = opened();
    (void)readInputText((folder / "a").string(), 7, "text");
    CHECK(opened() == before);
    CHECK_THROWS_AS(readInputText("/dev/zero", 1 << 20, "text"), Error);
    CHECK_THROWS_AS(readInputText((folder / "absent").string(), 7, "text"), Error);
    fs::remove_all(folder);
}

TEST_CASE("readInputText waits for a pipe whose writer takes its time")
{
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / ("gsc-commands-test-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    const std::string path = (folder / "pipe").string();
    REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
    const int keeps_it = ::open(path.c_str(), O_RDWR); // opened to write before it is read, so that it has no end yet
    REQUIRE(keeps_it >= 0);
    std::thread writer([keeps_it] {
        std::this_thread::sleep_for(std::chrono::milliseconds(250));
        (void)!::write(keeps_it, "late", 4);
        ::close(keeps_it);
    });
    CHECK(readInputText(path, 7, "text") == "late");
    writer.join();
    fs::remove_all(folder);
}

TEST_CASE("a view that is NaN or below the threshold is a difference")
{
    RenderComparison comparison;
    CHECK(comparison.passes(75));
    ScoredPicture view;
    view.difference.psnr = std::numeric_limits<double>::infinity();
    comparison.reference.views.push_back(view);
    CHECK(comparison.passes(75));
    view.difference.psnr = 74.9;
    comparison.trainer.views.push_back(view);
    CHECK_FALSE(comparison.passes(75));
    CHECK(comparison.passes(74));
    comparison.trainer.views[0].difference.psnr = std::nan("");
    CHECK_FALSE(comparison.passes(-1000));
}

TEST_CASE("an SPZ of more Gaussians than its readers take warns, and nothing else does")
{
    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / ("gsc-commands-test-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    SampleOptions sample;
    sample.scene = SampleScene::Room;
    sample.anchors = 300;
    sample.output = (folder / "room").string();
    makeSample(sample, {});
    WriteOptions baking;
    baking.output = (folder / "room.gsc").string();
    writeGsc(readCheckpoint(sample.output, {}), baking, {});
    GaussianExportOptions options;
    options.file = baking.output;
    options.degree = 0;
    options.overwrite = true;
    const auto warnings = [&](GaussianFileFormat to, uint64_t spz_most) {
        ReporterOptions quiet;
        quiet.quiet = true;
        quiet.progress = ProgressMode::None;
        Reporter report(quiet);
        options.to = to;
        options.spz_most = spz_most;
        options.output = (folder / "room.out").string();
        const uint64_t count = exportGaussians(options, report).gaussians;
        CHECK(count > 100);
        return std::pair(count, report.warnings());
    };
    CHECK(kSpzReadersTake == 10'000'000);
    const auto [count, none] = warnings(GaussianFileFormat::Spz, kSpzReadersTake);
    CHECK(none.empty());
    CHECK(warnings(GaussianFileFormat::Spz, count).second.empty());
    const auto told = warnings(GaussianFileFormat::Spz, count - 1).second;
    REQUIRE(told.size() == 1);
    CHECK(told[0].find("room.out: " + formatCount(count) + " Gaussians") != std::string::npos);
    CHECK(told[0].find("--max-gaussians " + std::to_string(count - 1)) != std::string::npos);
    CHECK(warnings(GaussianFileFormat::Ply, 1).second.empty());
    CHECK(warnings(GaussianFileFormat::Glb, 1).second.empty());
    options.most = count - 1; // remedy of the warning
    CHECK(warnings(GaussianFileFormat::Spz, count - 1).second.empty());
    fs::remove_all(folder);
}
