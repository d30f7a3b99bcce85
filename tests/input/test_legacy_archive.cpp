// SPDX-License-Identifier: Apache-2.0
// Files of torch.save before PyTorch 1.6. lpips_heads_legacy.pth is PyTorch's own (tests/runtime/lpips_reference.py).
#include "convert/input/torch/torch_archive.h"
#include <gsc/file/read_file.h>
#include "tests/input/legacy_file.h"
#include "tests/input/model_fixture.h"
#include "tests/support/lpips_random.h"
#include "tests/support/source_folder.h"

#include <doctest/doctest.h>

#include <cstring>
#include <memory>

using namespace gsc;
using namespace gsc::test;

namespace {

std::string headsFile()
{
    return readInputText(sourceFolder() + "/tests/input/lpips_heads_legacy.pth", 1 << 20, "test data");
}

TorchArchive readText(const std::string& text, const WantedTensor& wanted = {})
{
    // exact-size heap copy, so that ASan sees a read of even one byte too many
    const std::unique_ptr<std::byte[]> copy(new std::byte[text.size()]);
    std::memcpy(copy.get(), text.data(), text.size());
    return readTorchArchive({copy.get(), text.size()}, "old.pth", wanted);
}

Outcome readingOf(const std::string& text)
{
    return outcomeOf([&] { (void)readText(text); });
}

void checkOneTwoThree(const std::string& object)
{
    OldFile file;
    file.object = object;
    const TorchArchive archive = readText(file.text());
    REQUIRE(archive.tensors.size() == 1);
    CHECK(archive.tensors[0].name == "w");
    CHECK(archive.tensors[0].shape == std::vector<uint64_t>{3});
    CHECK(archive.tensors[0].values == std::vector<float>{1, 2, 3});
}

} // namespace

TEST_CASE("legacy archive: what PyTorch saved is read bit for bit")
{
    const TorchArchive archive = readText(headsFile());
    const LpipsWeights expected = lpipsRandomWeights();
    CHECK_FALSE(archive.is_script);
    REQUIRE(archive.tensors.size() == kLpipsStages);
    for (uint32_t stage = 0; stage < kLpipsStages; ++stage) {
        CHECK(archive.tensors[stage].name == "lin" + std::to_string(stage) + ".model.1.weight");
        CHECK(archive.tensors[stage].shape == std::vector<uint64_t>{1, kLpipsChannels[stage], 1, 1});
        CHECK(archive.tensors[stage].values == expected.head[stage]);
    }
}

TEST_CASE("legacy archive: only tensors that are wanted are read")
{
    const TorchArchive archive =
        readText(headsFile(), [](const std::string& name) { return name.starts_with("lin3"); });
    REQUIRE(archive.tensors.size() == 1);
    CHECK(archive.tensors[0].name == "lin3.model.1.weight");
}

TEST_CASE("legacy archive: Python 2, tensors of PyTorch 0.3, parameters")
{
    checkOneTwoThree(oldDict("w", oldTensor()));
    // a parameter made from its tensor, and one that gets it as its state
    const std::string state = "(" + oldTensor() + "\x88\x89Nt";
    checkOneTwoThree(oldDict("w", "ctorch.nn.parameter\nParameter\n(" + oldTensor() + "t\x81" + state + "b"));
    checkOneTwoThree(oldDict("w", "ctorch.nn.parameter\nParameter\n)\x81" + state + "b"));
}

TEST_CASE("legacy archive: every truncation is refused, and so are bytes that say something else")
{
    const std::string text = headsFile();
    for (size_t size = 1; size < text.size(); ++size)
        REQUIRE(readingOf(text.substr(0, size)).code == ErrorCode::InvalidFile);
    const size_t head = text.size() - 4 * (64 + 128 + 256 + 512 + 512); // about where the values begin
    for (size_t i = 0; i < 8 * head; ++i) {
        std::string flipped = text;
        flipped[i / 8] = char(flipped[i / 8] ^ (1 << (i % 8)));
        const ErrorCode code = readingOf(flipped).code; // no checksum: some flips change a name or a shape
        REQUIRE((code == ErrorCode::Ok || code == ErrorCode::InvalidFile || code == ErrorCode::Unsupported));
    }
}

TEST_CASE("legacy archive: what the memo multiplies has a budget")
{
    constexpr int kCalls = 1000;
    const auto refuses = [](auto change, const char* words) {
        OldFile file;
        file.object = oldDict("w", oldTensor());
        change(file);
        const Outcome outcome = readingOf(file.text());
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK_MESSAGE(outcome.says(words), outcome.message);
    };
    std::string shared = kProto + "](](]" + shortText("a") + "aNaq\x01"; // one pair, many times in a list
    for (int i = 0; i < kCalls; ++i)
        shared += "h\x01";
    shared += "eq\x02";
    for (int i = 0; i < kCalls; ++i)
        shared += "ccollections\nOrderedDict\n(h\x02tR";
    for (std::string OldFile::*part : {&OldFile::protocol, &OldFile::machine, &OldFile::object, &OldFile::keys})
        refuses([&](OldFile& file) { file.*part = shared + "e."; }, "values that are used again take more than");
    const std::string key(5000, 'k'), long_text = "T" + little64(key.size()).substr(0, 4) + key;
    // a long key in many storages
    std::string storages = kProto + "]((" + shortText("storage") + "ctorch\nFloatStorage\n" + long_text +
                           shortText("cpu") + "K\x03Ntq\x01Q";
    for (int i = 0; i < kCalls; ++i)
        storages += "h\x01Q";
    refuses([&](OldFile& file) { file.object = storages + "e."; }, "values that are used again take more than");
}

TEST_CASE("legacy archive: refusals name what was found")
{
    OldFile good;
    good.object = oldDict("w", oldTensor());
    const auto refuses = [&](auto change, ErrorCode code, const char* words) {
        OldFile file = good;
        change(file);
        const Outcome outcome = readingOf(file.text());
        CAPTURE(words);
        CHECK(outcome.code == code);
        CHECK(outcome.says(words));
    };
    refuses([](OldFile& f) { f.magic[8] ^= 1; }, ErrorCode::InvalidFile, "magic number of torch.save");
    refuses([](OldFile& f) { f.protocol = kProto + "M\xea\x03."; }, ErrorCode::Unsupported, "expected 1001");
    refuses([](OldFile& f) { f.machine = kProto + "N."; }, ErrorCode::InvalidFile, "facts of the machine");
    refuses([](OldFile& f) { f.machine = kProto + "}" + shortText("little_endian") + "\x89s."; },
            ErrorCode::Unsupported, "big-endian");
    refuses([](OldFile& f) { f.object = oldDict("w", oldTensor("(t")); }, ErrorCode::Unsupported, "part of another");
    refuses([](OldFile& f) { f.object = oldDict("w", oldTensor("N", "OddStorage")); }, ErrorCode::Unsupported,
            "torch OddStorage");
    refuses([](OldFile& f) { f.object = oldDict("w", "cposix\nsystem\n(tR"); }, ErrorCode::Unsupported, "posix system");
    refuses([](OldFile& f) { f.object = oldDict("w", "ctorch.nn.parameter\nParameter\n)\x81(Ntb"); },
            ErrorCode::InvalidFile, "tensor of a parameter");
    refuses([](OldFile& f) { f.object = kProto + "ccollections\nOrderedDict\n(](NetR."; }, ErrorCode::InvalidFile,
            "no pair");
    refuses([](OldFile& f) { f.keys = kProto + "N."; }, ErrorCode::InvalidFile, "no list of its storages");
    refuses(
        [](OldFile& f) {
            f.keys = kProto + "](K\x05"
                              "e.";
        },
        ErrorCode::InvalidFile, "whose key is no text");
    refuses([](OldFile& f) { f.keys = kProto + "]."; }, ErrorCode::InvalidFile, "storage '70' is missing");
    refuses([](OldFile& f) { f.keys = kProto + "](" + shortText("71") + "e."; }, ErrorCode::InvalidFile,
            "belongs to nothing");
    refuses(
        [](OldFile& f) {
            f.keys = kProto + "](" + shortText("70") + shortText("70") + "e.";
            f.storages += f.storages;
        },
        ErrorCode::InvalidFile, "occurs twice");
    refuses([](OldFile& f) { f.storages[0] = 4; }, ErrorCode::InvalidFile, "ends within storage '70'");
    refuses([](OldFile& f) { f.storages[0] = 2; }, ErrorCode::InvalidFile, "2 elements, expected the 3");
    refuses([](OldFile& f) { f.storages = little64(~0ull) + f.storages; }, ErrorCode::InvalidFile, "ends within");
}
