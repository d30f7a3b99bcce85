// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/pickle_machine.h"
#include "convert/input/torch/torch_archive.h"
#include "convert/input/torch/zip_archive.h"
#include "convert/input/torch/zip_writer.h"
#include "tests/input/model_fixture.h"
#include "tests/input/torch_files.h"

#include <doctest/doctest.h>

#include <cstring>
#include <memory>

using namespace gsc;
using namespace gsc::test;

namespace {

uint32_t load(const std::vector<std::byte>& bytes, size_t offset, size_t count)
{
    uint32_t value = 0;
    std::memcpy(&value, bytes.data() + offset, count);
    return value;
}

const NamedTensor& tensor(const TorchArchive& archive, const std::string& name)
{
    for (const NamedTensor& candidate : archive.tensors)
        if (candidate.name == name)
            return candidate;
    throw Error(ErrorCode::Internal, name, "no such tensor", "one", "mend the test");
}

void checkLayers(const TorchArchive& archive, const std::string& prefix, const Mlp& mlp)
{
    for (int i = 0; i < 2; ++i) {
        const std::string layer = prefix + (i == 0 ? "0." : "2.");
        CHECK(tensor(archive, layer + "weight").shape == std::vector<uint64_t>{mlp.layers[i].out, mlp.layers[i].in});
        CHECK(tensor(archive, layer + "weight").values == mlp.layers[i].weight);
        CHECK(tensor(archive, layer + "bias").shape == std::vector<uint64_t>{mlp.layers[i].out});
        CHECK(tensor(archive, layer + "bias").values == mlp.layers[i].bias);
    }
}

bool sameContent(const TorchArchive& a, const TorchArchive& b)
{
    if (a.is_script != b.is_script || a.root_class != b.root_class || a.modules != b.modules ||
        a.tensors.size() != b.tensors.size())
        return false;
    for (size_t i = 0; i < a.tensors.size(); ++i)
        if (a.tensors[i].name != b.tensors[i].name || a.tensors[i].shape != b.tensors[i].shape ||
            a.tensors[i].values != b.tensors[i].values)
            return false;
    return true;
}

// An archive around a pickle of our own; data/0 holds `floats` zeros.
std::vector<std::byte> archiveOf(const std::string& pickle, size_t floats = 0, const std::string& version = "3\n",
                                 const std::string& byteorder = "")
{
    ZipWriter zip("archive");
    zip.add("data.pkl", pickle);
    zip.add("data/0", std::string(floats * sizeof(float), '\0'));
    zip.add("version", version);
    if (!byteorder.empty())
        zip.add("byteorder", byteorder);
    return zip.finish();
}

Outcome readOutcome(const std::vector<std::byte>& bytes)
{
    return outcomeOf([&] { (void)readTorchArchive(bytes, "test.pth"); });
}

std::string unicode(const std::string& text)
{
    return std::string("X") + char(text.size()) + std::string(3, '\0') + text;
}

// {'w': tensor of `shape` and `stride` over a storage of `count`}; each number as LONG1 of 8 bytes
std::string tensorPickle(uint64_t count, const std::vector<uint64_t>& shape, const std::vector<uint64_t>& stride,
                         const std::string& storage = "FloatStorage", uint64_t offset = 0)
{
    const auto number = [](uint64_t value) {
        std::string text = "\x8a\x08";
        text.append(reinterpret_cast<const char*>(&value), sizeof(value));
        return text;
    };
    std::string pickle = std::string("\x80\x02}", 3) + unicode("w") + "ctorch._utils\n_rebuild_tensor_v2\n((" +
                         unicode("storage") + "ctorch\n" + storage + "\n" + unicode("0") + unicode("cuda:0") +
                         number(count) + "tQ" + number(offset);
    for (const auto* values : {&shape, &stride}) {
        pickle += "(";
        for (const uint64_t value : *values)
            pickle += number(value);
        pickle += "t";
    }
    return pickle + "\x89" + "ccollections\nOrderedDict\n)RtRs.";
}

} // namespace

TEST_CASE("torch archive: what the TorchScript writer wrote is read back bit for bit")
{
    for (const MlpKind kind : {MlpKind::Opacity, MlpKind::Covariance, MlpKind::Color, MlpKind::FeatureBank}) {
        const Mlp mlp = makeMlp(kind, 36, 32, 70, 11 + uint32_t(kind));
        const TorchArchive archive = readTorchArchive(writeTorchScriptMlp(mlp, "cov_mlp"), "cov_mlp.pt");
        CHECK(archive.is_script);
        CHECK(archive.root_class == "Sequential");
        CHECK(archive.tensors.size() == 4);
        CHECK(archive.modules.size() == (kind == MlpKind::Covariance ? 3 : 4));
        CHECK(archive.modules[2] == std::pair<std::string, std::string>("2", "Linear"));
        checkLayers(archive, "", mlp);
    }
    const std::vector<float> values = {1, 2, 3, 4, 5, 6};
    const TorchArchive embedding = readTorchArchive(writeTorchScriptEmbedding(values, 3, 2, "e"), "e.pt");
    CHECK(embedding.root_class == "Embedding");
    CHECK(tensor(embedding, "embedding.weight").values == values);
    CHECK(tensor(embedding, "embedding.weight").shape == std::vector<uint64_t>{3, 2});
    for (const uint32_t rows : {255u, 256u, 65535u, 65536u}) { // numbers of one, two and four bytes
        const std::vector<float> column(rows, 0.5f);
        const TorchArchive read = readTorchArchive(writeTorchScriptEmbedding(column, rows, 1, "e"), "e.pt");
        CHECK(tensor(read, "embedding.weight").shape == std::vector<uint64_t>{rows, 1});
        CHECK(tensor(read, "embedding.weight").values == column);
    }
}

TEST_CASE("torch archive, trap 4: state dictionaries keep their keys free of _metadata")
{
    const WeightSet weights = makeWeights(10, 32, {1, 1, 1, 1, 43, 32});
    std::vector<std::pair<std::string, const Mlp*>> mlps;
    for (const Mlp& mlp : weights.mlps)
        mlps.emplace_back("mlp" + std::to_string(mlps.size()), &mlp);
    const TorchArchive archive =
        readTorchArchive(writeStateDictArchive(mlps, weights.embedding, 43, 32), "checkpoints.pth");
    CHECK_FALSE(archive.is_script);
    CHECK(archive.modules.empty());
    CHECK(archive.tensors.size() == 17); // 4 x (2 weights + 2 biases) + 1, and nothing of '_metadata'
    for (size_t i = 0; i < weights.mlps.size(); ++i)
        checkLayers(archive, "mlp" + std::to_string(i) + ".", weights.mlps[i]);
    CHECK(tensor(archive, "appearance.embedding.weight").values == weights.embedding);
}

TEST_CASE("torch archive: a dictionary of tensors is read back, or the wanted part of it")
{
    const std::vector<NamedTensor> tensors = {{"a.weight", {2, 1, 3}, {1, 2, 3, 4, 5, 6}}, {"b.bias", {1}, {7}}};
    const std::vector<std::byte> bytes = writeTensorArchive(tensors);
    const TorchArchive archive = readTorchArchive(bytes, "t.pth");
    REQUIRE(archive.tensors.size() == 2);
    for (size_t i = 0; i < 2; ++i) {
        CHECK(archive.tensors[i].name == tensors[i].name);
        CHECK(archive.tensors[i].shape == tensors[i].shape);
        CHECK(archive.tensors[i].values == tensors[i].values);
    }
    const TorchArchive part = readTorchArchive(bytes, "t.pth", [](const std::string& name) { return name[0] == 'b'; });
    REQUIRE(part.tensors.size() == 1);
    CHECK(part.tensors[0].name == "b.bias");
}

TEST_CASE("torch archive, trap 4: a storage key may be a memo reference to a module name")
{
    const std::vector<std::byte> bytes = writeTorchScriptMlp(makeMlp(MlpKind::Opacity, 7, 4, 2, 5), "opacity_mlp");
    const std::vector<std::byte> pickle = ZipArchive(bytes, "test").read("opacity_mlp/data.pkl");
    const std::string text(reinterpret_cast<const char*>(pickle.data()), pickle.size());
    // the string "0" (child name) is stored once, the storage key "0" refers to it
    const std::string zero = unicode("0");
    CHECK(text.find(zero) != std::string::npos);
    CHECK(text.find(zero, text.find(zero) + 1) == std::string::npos);
}

TEST_CASE("torch archive, trap 3: local headers with zero sizes, 64-byte payloads, ZIP64 records, any folder name")
{
    const Mlp mlp = makeMlp(MlpKind::Opacity, 7, 4, 2, 5);
    const std::vector<std::byte> bytes = writeTorchScriptMlp(mlp, "stem_at_save_time");
    size_t headers = 0;
    for (size_t i = 0; i + 30 < bytes.size(); ++i)
        if (load(bytes, i, 4) == 0x04034b50) {
            ++headers;
            CHECK(load(bytes, i + 6, 2) == 0x0808);
            for (size_t field = 10; field < 26; field += 2) // date, time, CRC, sizes
                CHECK(load(bytes, i + field, 2) == 0);
            CHECK((i + 30 + load(bytes, i + 26, 2) + load(bytes, i + 28, 2)) % 64 == 0);
        }
    CHECK(headers == 11); // 4 storages, data.pkl, 4 code files, constants.pkl, version
    CHECK(load(bytes, bytes.size() - 22 - 20, 4) == 0x07064b50); // ZIP64 locator before the classic end record
    checkLayers(readTorchArchive(bytes, "renamed.pt"), "", mlp);
}

TEST_CASE("torch archive, trap 5: the device of a storage is ignored")
{
    const std::string pickle = tensorPickle(6, {2, 3}, {3, 1});
    CHECK(pickle.find("cuda:0") != std::string::npos);
    CHECK(tensor(readTorchArchive(archiveOf(pickle, 6), "t"), "w").values.size() == 6);
}

TEST_CASE("torch archive: every truncation is refused")
{
    const std::vector<std::byte> bytes = writeTorchScriptMlp(makeMlp(MlpKind::Opacity, 7, 4, 2, 5), "opacity_mlp");
    for (size_t size = 0; size < bytes.size(); ++size) {
        // exact-size heap copy, so that ASan sees a read of even one byte too many
        const std::unique_ptr<std::byte[]> copy(new std::byte[size]);
        std::memcpy(copy.get(), bytes.data(), size);
        const Outcome outcome = outcomeOf([&] { (void)readTorchArchive({copy.get(), size}, "cut.pt"); });
        REQUIRE(outcome.code == ErrorCode::InvalidFile);
    }
}

TEST_CASE("torch archive: a flipped bit is refused or changes nothing")
{
    const std::vector<std::byte> bytes = writeTorchScriptMlp(makeMlp(MlpKind::Opacity, 7, 4, 2, 5), "opacity_mlp");
    const TorchArchive original = readTorchArchive(bytes, "opacity_mlp.pt");
    size_t refused = 0;
    for (size_t i = 0; i < bytes.size(); ++i) {
        std::vector<std::byte> flipped = bytes;
        flipped[i] ^= std::byte(1u << (i % 8));
        TorchArchive result;
        const Outcome outcome = outcomeOf([&] { result = readTorchArchive(flipped, "flipped.pt"); });
        refused += outcome.code != ErrorCode::Ok;
        CAPTURE(i);
        REQUIRE((outcome.code == ErrorCode::InvalidFile || outcome.code == ErrorCode::Unsupported ||
                 (outcome.code == ErrorCode::Ok && sameContent(result, original))));
    }
    CHECK(refused > 1000); // weights, pickle and directory are all guarded
}

TEST_CASE("pickle machine: truncated, flipped and hostile pickles end in an Error")
{
    const std::string pickle = tensorPickle(6, {2, 3}, {3, 1});
    const auto run = [](const std::string& text) {
        const std::unique_ptr<std::byte[]> copy(new std::byte[text.size()]);
        std::memcpy(copy.get(), text.data(), text.size());
        return outcomeOf([&] { (void)loadPickle({copy.get(), text.size()}, "p"); });
    };
    CHECK(run(pickle).code == ErrorCode::Ok);
    for (size_t size = 0; size < pickle.size(); ++size)
        REQUIRE(run(pickle.substr(0, size)).code == ErrorCode::InvalidFile);
    for (size_t i = 0; i < 8 * pickle.size(); ++i) {
        std::string flipped = pickle;
        flipped[i / 8] = char(flipped[i / 8] ^ (1 << (i % 8)));
        const ErrorCode code = run(flipped).code;
        REQUIRE((code == ErrorCode::Ok || code == ErrorCode::InvalidFile || code == ErrorCode::Unsupported));
    }
    const auto refuses = [&](const std::string& body, ErrorCode code) {
        CAPTURE(body);
        CHECK(run("\x80\x02" + body).code == code);
    };
    refuses(".", ErrorCode::InvalidFile);                                           // nothing on the stack
    refuses("t.", ErrorCode::InvalidFile);                                          // no mark
    refuses("Ns.", ErrorCode::InvalidFile);                                         // stack underflow
    refuses("(N0.", ErrorCode::InvalidFile);                                        // nothing but a mark is left
    refuses("N\x99.", ErrorCode::InvalidFile);                                      // no protocol has this opcode
    refuses("Nos.", ErrorCode::Unsupported);                                        // OBJ makes an object of any class
    refuses(std::string("Nr\xff\xff\xff\xff.", 7), ErrorCode::InvalidFile);         // memo slot 2^32 - 1
    refuses(std::string("Nh\x05.", 4), ErrorCode::InvalidFile);                     // empty memo slot
    refuses(std::string("X\xff\xff\xff\x7f.", 6), ErrorCode::InvalidFile);          // string of 2 GiB
    refuses("cposix\nsystem\n(" + unicode("true") + "tR.", ErrorCode::Unsupported); // the classic
    refuses("c__builtin__\neval\n.", ErrorCode::Unsupported);
    refuses("c" + std::string(4000, 'a') + "\nb\n.", ErrorCode::InvalidFile);
    refuses("ccollections\nOrderedDict\n(NtR.", ErrorCode::Unsupported);
    refuses("}(NNNu.", ErrorCode::InvalidFile); // a key without a value
    for (const char protocol : {'\1', '\2', '\3', '\4', '\5'})
        CHECK(run(std::string("\x80") + protocol + "N.").code == ErrorCode::Ok);
    CHECK(run(std::string("\x80\x06N.")).says("protocol 6"));
    // kept in the memo and taken off the stack, so that there are many values and few on the stack
    const auto values = [&](size_t count) {
        std::string body = "]";
        for (size_t i = 0; i < count; ++i)
            body += "Na";
        return run("\x80\x02" + body + ".");
    };
    const std::string large = "\x80\x02" + std::string((16 << 20) - 2, 'N');
    CHECK(run(large).says("more than 262144 values"));
    CHECK(run(large + "N").says("pickle of 16777217 bytes, at most 16777216 are read"));
    CHECK(values(200000).code == ErrorCode::Ok);
    CHECK(values(300000).says("more than 262144 values"));
}

TEST_CASE("pickle machine: the stack holds as many values as there may be, however they came there")
{
    const auto run = [](const std::string& body) {
        const std::string pickle = "\x80\x02" + body + std::string(262143, '0') + "."; // POP all but one
        return outcomeOf([&] { (void)loadPickle(std::as_bytes(std::span(pickle)), "p"); });
    };
    const std::string full = "Nq\1" + std::string(262143, '2'); // DUP
    CHECK(run(full).code == ErrorCode::Ok);
    CHECK(run(full + "0h\1").code == ErrorCode::Ok); // BINGET of what the memo has
    for (const char* more : {"2", "h\1"}) {
        const Outcome outcome = run(full + more);
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK_MESSAGE(outcome.says("more than 262144 values on the stack"), outcome.message);
    }
}

TEST_CASE("torch archive: cycles and exponentially shared values are refused")
{
    const std::string cycle = std::string("\x80\x02}q\x00", 5) + unicode("a") + std::string("h\x00s.", 4);
    CHECK(readOutcome(archiveOf(cycle)).code == ErrorCode::InvalidFile);
    // dictionaries nested 14 deep, each with nine references to the next: 9^14 entries from 600 bytes
    constexpr char depth = 14;
    std::string bomb = std::string("\x80\x02}q\x00", 5);
    for (char level = 1; level <= depth; ++level)
        bomb += unicode("a") + "}q" + level;
    for (char level = depth; level >= 1; --level) {
        bomb += 's';
        for (char key = 'b'; key < 'j'; ++key)
            bomb += unicode(std::string(1, key)) + 'h' + level + 's';
    }
    const Outcome outcome = readOutcome(archiveOf(bomb + '.'));
    CHECK(outcome.code == ErrorCode::InvalidFile);
    CHECK(outcome.says("more than 100000 entries"));
}

TEST_CASE("pickle machine: copies of what is in the memo have a budget")
{
    constexpr int kTimes = 1000;
    const auto refuses = [](const std::string& body) {
        const std::string pickle = "\x80\x02" + body;
        const Outcome outcome = outcomeOf([&] { (void)loadPickle(std::as_bytes(std::span(pickle)), "p"); });
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK_MESSAGE(outcome.says("p: values that are used again take more than"), outcome.message);
        CHECK(outcome.says("save it again"));
    };
    const auto times = [](const std::string& text) {
        std::string all;
        for (int i = 0; i < kTimes; ++i)
            all += text;
        return all;
    };
    const std::string key(5000, 'k'), long_key = "X\x88\x13" + std::string(2, '\0') + key;
    const std::string storage =
        "(" + unicode("storage") + "ctorch\nFloatStorage\n" + long_key + unicode("cpu") + "K\1t";
    const std::string small =
        "(" + unicode("storage") + "ctorch\nFloatStorage\n" + unicode("0") + unicode("cpu") + "K\1t";
    // an OrderedDict of one list, again and again; the list has one pair again and again
    refuses("](](]" + unicode("a") + "aNaq\1" + times("h\1") + "eq\2" + times("ccollections\nOrderedDict\n(h\2tR") +
            "e.");
    refuses("](" + storage + "q\1Q" + times("h\1Q") + "e.");
    // tensors of one storage
    const std::string rest = std::string("K\0(K\1t(K\1t\x89Nt", 13);
    refuses("](" + storage + "Qq\1" + "ctorch._utils\n_rebuild_tensor_v2\nq\2(h\1" + rest + "q\3R" + times("h\2h\3R") +
            "e.");
    // objects of a class with a long name
    refuses("](c__torch__." + std::string(490, 'm') + "\n" + std::string(500, 'n') + "\nq\1" +
            times("h\1)\x81h\1)\x81") + "e.");
    // what a pickle without a memo does is within it
    std::string plain = "](";
    for (int i = 0; i < kTimes; ++i)
        plain += "ctorch._utils\n_rebuild_tensor_v2\n(" + small + "Q" + rest + "R";
    plain = "\x80\x02" + plain + "e.";
    CHECK(outcomeOf([&] { (void)loadPickle(std::as_bytes(std::span(plain)), "p"); }).message.empty());
}

TEST_CASE("torch archive: a long name that many dictionaries share is refused before it is copied")
{
    // a dictionary whose values are all the same dictionary, which has a module with a name of 5,000 characters
    std::string shared = "}(X\x88\x13" + std::string(2, '\0') + std::string(5000, 'k') + "c__torch__.m\nn\n)\x81uq\1";
    std::string body = "\x80\x02}(" + unicode("a") + shared;
    for (char first = 'b'; first <= 'z'; ++first)
        body += unicode(std::string(1, first)) + "h\1";
    const Outcome outcome = readOutcome(archiveOf(body + "u."));
    CHECK(outcome.code == ErrorCode::InvalidFile);
    CHECK_MESSAGE(outcome.says("makes a name of 5002 characters, expected at most 512"), outcome.message);
}

TEST_CASE("torch archive: counts that lie are refused before anything is allocated")
{
    const auto refuses = [](const std::string& pickle, size_t floats) {
        CHECK(readOutcome(archiveOf(pickle, floats)).code == ErrorCode::InvalidFile);
    };
    refuses(tensorPickle(1ull << 60, {1ull << 60}, {1}), 6);
    refuses(tensorPickle(6, {1ull << 62, 1ull << 62}, {1ull << 62, 1}), 6); // the product wraps to 0
    refuses(tensorPickle(6, {2, 4}, {4, 1}), 6);                            // more than the storage
    refuses(tensorPickle(6, {2, 3}, {3, 1}), 5);                            // member shorter than the storage
    refuses(tensorPickle(6, {2, 3}, {3}), 6);
    refuses(tensorPickle(~0ull, {1}, {1}), 6);                                               // negative count
    CHECK(readOutcome(archiveOf(tensorPickle(6, {2, 3}, {1, 2}), 6)).code == ErrorCode::Ok); // transposed
    CHECK(readOutcome(archiveOf(tensorPickle(6, {2, 3}, {3, 1}), 6)).code == ErrorCode::Ok);
    CHECK(readOutcome(archiveOf(tensorPickle(6, {5}, {1}, "FloatStorage", 1), 6)).code == ErrorCode::Ok);
    CHECK(readOutcome(archiveOf(tensorPickle(0, {0}, {1}), 0)).code == ErrorCode::Ok);
    refuses(tensorPickle(6, {6}, {1}, "FloatStorage", 1), 6); // its end lies behind the storage
    refuses(tensorPickle(6, {1}, {1}, "FloatStorage", 7), 6); // and here its start
}

TEST_CASE("torch archive: refusals name what was found")
{
    const Outcome half = readOutcome(archiveOf(tensorPickle(6, {6}, {1}, "HalfStorage"), 6));
    CHECK(half.code == ErrorCode::Unsupported);
    CHECK(half.says("HalfStorage"));
    const std::string good = tensorPickle(6, {6}, {1});
    CHECK(readOutcome(archiveOf(good, 6, "10\n")).code == ErrorCode::Ok);
    CHECK(readOutcome(archiveOf(good, 6, "11\n")).code == ErrorCode::Unsupported);
    CHECK(readOutcome(archiveOf(good, 6, "3\n", "little")).code == ErrorCode::Ok);
    CHECK(readOutcome(archiveOf(good, 6, "3\n", "big")).says("byte order is 'big'"));
    CHECK(readOutcome(archiveOf(std::string("\x80\x02)."), 0)).says("neither a module nor a dictionary"));
    CHECK(readOutcome({}).code == ErrorCode::InvalidFile);
}
