// SPDX-License-Identifier: Apache-2.0
// Archives as torch.save leaves them where it is not told what the trainers tell it: what torch.load takes is read, or
// refused as unsupported, and only what is damaged is called so.
#include "convert/input/torch/torch_archive.h"
#include "convert/input/torch/zip_writer.h"
#include "tests/input/legacy_file.h"
#include "tests/input/model_fixture.h"

#include <doctest/doctest.h>

#include <bit>
#include <cstring>
#include <zip.h>

using namespace gsc;
using namespace gsc::test;

namespace {

using Bytes = std::vector<std::byte>;
using Members = std::vector<std::pair<std::string, std::string>>;

std::string text32(const std::string& text)
{
    return "X" + std::string(1, char(text.size())) + std::string(3, '\0') + text;
}

std::string small(int value)
{
    return std::string("K") + char(value);
}

std::string tupleOf(const std::vector<int>& values)
{
    std::string text = "(";
    for (const int value : values)
        text += small(value);
    return text + "t";
}

// A tensor over storage `key` of `count` elements.
std::string tensorOf(const std::string& key, int count, int offset, const std::vector<int>& shape,
                     const std::vector<int>& stride, const std::string& storage = "FloatStorage",
                     const std::string& location = "cpu")
{
    return "ctorch._utils\n_rebuild_tensor_v2\n((" + text32("storage") + "ctorch\n" + storage + "\n" + text32(key) +
           text32(location) + small(count) + "tQ" + small(offset) + tupleOf(shape) + tupleOf(stride) +
           "\x89"
           "ccollections\nOrderedDict\n)RtR";
}

std::string floats(const std::vector<float>& values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

std::string dictOf(const Members& entries)
{
    std::string text = "ccollections\nOrderedDict\n)R(";
    for (const auto& [key, value] : entries)
        text += text32(key) + value;
    return text + "u";
}

Bytes archiveOf(const std::string& object, const Members& storages, const Members& others = {})
{
    ZipWriter zip("archive");
    zip.add("data.pkl", "\x80\x02" + object + ".");
    for (const auto& [key, bytes] : storages)
        zip.add("data/" + key, bytes);
    zip.add("version", std::string("3\n"));
    for (const auto& [name, bytes] : others)
        zip.add(name, bytes);
    return zip.finish();
}

std::vector<float> valuesOf(const Bytes& bytes, const std::string& name)
{
    for (const NamedTensor& tensor : readTorchArchive(bytes, "t.pth").tensors)
        if (tensor.name == name)
            return tensor.values;
    return {};
}

Outcome readingOf(const Bytes& bytes, const WantedTensor& wanted = {})
{
    return outcomeOf([&] { (void)readTorchArchive(bytes, "t.pth", wanted); });
}

Bytes bytesOf(const std::string& text)
{
    const auto* first = reinterpret_cast<const std::byte*>(text.data());
    return {first, first + text.size()};
}

// Archive of the members as zip tools would write it, packed with `method`.
Bytes zipped(const Members& members, zip_int32_t method)
{
    zip_error_t error;
    zip_source_t* source = zip_source_buffer_create(nullptr, 0, 0, &error);
    zip_source_keep(source);
    zip_t* zip = zip_open_from_source(source, ZIP_TRUNCATE, &error);
    for (const auto& [name, text] : members) {
        const zip_int64_t index =
            zip_file_add(zip, name.c_str(), zip_source_buffer(zip, text.data(), text.size(), 0), ZIP_FL_ENC_UTF_8);
        zip_set_file_compression(zip, zip_uint64_t(index), method, 0);
    }
    REQUIRE(zip_close(zip) == 0);
    REQUIRE(zip_source_open(source) == 0);
    zip_source_seek(source, 0, SEEK_END);
    Bytes bytes(size_t(zip_source_tell(source)));
    zip_source_seek(source, 0, SEEK_SET);
    REQUIRE(zip_source_read(source, bytes.data(), bytes.size()) == zip_int64_t(bytes.size()));
    zip_source_close(source);
    zip_source_free(source);
    return bytes;
}

const std::vector<float> kSix = {1, 2, 3, 4, 5, 6};

} // namespace

TEST_CASE("torch variants: tensors of any stride, offset and device, alone or as views of one storage")
{
    const auto six = [](int offset, const std::vector<int>& shape, const std::vector<int>& stride,
                        const std::string& location = "cpu") {
        return valuesOf(archiveOf(dictOf({{"w", tensorOf("0", 6, offset, shape, stride, "FloatStorage", location)}}),
                                  {{"0", floats(kSix)}}),
                        "w");
    };
    CHECK(six(0, {2, 3}, {3, 1}) == kSix);
    CHECK(six(0, {3, 2}, {1, 3}) == std::vector<float>{1, 4, 2, 5, 3, 6});       // transposed
    CHECK(six(4, {2, 2}, {0, 1}) == std::vector<float>{5, 6, 5, 6});             // expanded
    CHECK(six(1, {3}, {2}) == std::vector<float>{2, 4, 6});                      // every second
    CHECK(six(0, {5}, {0}) == std::vector<float>(5, 1));                         // one value
    CHECK(six(0, {2, 1, 3}, {3, 77, 1}) == kSix);                                // a stride that nothing uses
    CHECK(six(0, {3, 2, 1}, {1, 3, 6}) == std::vector<float>{1, 4, 2, 5, 3, 6}); // columns of columns
    CHECK(six(2, {}, {}) == std::vector<float>{3});                              // a number
    CHECK(six(6, {0}, {1}).empty());                                             // nothing, at the end
    for (const char* device : {"cpu", "cuda:0", "cuda:7", "mps", "xpu:0", "hpu"})
        CHECK(six(0, {2, 3}, {3, 1}, device) == kSix);
    // one storage of all weights, as flattened parameters are saved
    Members views;
    for (int i = 0; i < 12; ++i)
        views.emplace_back("w" + std::to_string(i), tensorOf("0", 6, i % 6, {6 - i % 6}, {1}));
    const Bytes shared = archiveOf(dictOf(views), {{"0", floats(kSix)}});
    CHECK(readTorchArchive(shared, "t.pth").tensors.size() == 12);
    CHECK(valuesOf(shared, "w9") == std::vector<float>{4, 5, 6});
    // a tensor that reaches too far in any of these ways
    for (const auto& [offset, shape, stride] : {std::tuple{1, std::vector{2, 3}, std::vector{3, 1}},
                                                {0, std::vector{3, 2}, std::vector{2, 3}},
                                                {0, std::vector{4}, std::vector{2}},
                                                {6, std::vector{1}, std::vector{1}},
                                                {7, std::vector{0}, std::vector{1}}})
        CHECK(readingOf(archiveOf(dictOf({{"w", tensorOf("0", 6, offset, shape, stride)}}), {{"0", floats(kSix)}}))
                  .says("reaches beyond its storage"));
    // from little much, which torch.load would make
    const Outcome much = readingOf(
        archiveOf(dictOf({{"w", tensorOf("0", 6, 0, {127, 127, 127, 127}, {0, 0, 0, 0})}}), {{"0", floats(kSix)}}));
    CHECK(much.code == ErrorCode::Unsupported);
    CHECK(much.says("many times the values"));
}

TEST_CASE("torch variants: a storage that is stated twice, larger the second time, is not read beyond its end")
{
    const Bytes twice = archiveOf(dictOf({{"a", tensorOf("0", 2, 0, {2}, {1})}, {"b", tensorOf("0", 7, 0, {7}, {1})}}),
                                  {{"0", floats({1, 2})}});
    const Outcome outcome = outcomeOf([&] { (void)readTorchArchive(twice, "t.pth"); });
    CHECK(outcome.code == ErrorCode::InvalidFile);
    CHECK(outcome.says("'b'"));
}

TEST_CASE("torch variants: what wraps a network is left out of its names, whatever wraps what")
{
    const auto named = [](const std::string& key) {
        return readTorchArchive(archiveOf(dictOf({{key, tensorOf("0", 6, 0, {6}, {1})}}), {{"0", floats(kSix)}}), "t")
            .tensors.at(0)
            .name;
    };
    for (const char* prefix : {"", "module.", "_orig_mod.", "module._orig_mod.", "_orig_mod.module.", "module.module.",
                               "_fsdp_wrapped_module.", "module._checkpoint_wrapped_module."})
        CHECK(named(std::string(prefix) + "0.weight") == "0.weight");
    CHECK(named("opacity_mlp.module.0.weight") == "opacity_mlp.0.weight");
    CHECK(named("module.opacity_mlp._orig_mod.0.weight") == "opacity_mlp.0.weight");
    CHECK(named("0._orig_mod.weight") == "0.weight");
    CHECK(named("modules.0.weight") == "modules.0.weight");
    CHECK(named("my_module.0.weight") == "my_module.0.weight");
    // both, and neither is chosen
    const std::string one = tensorOf("0", 6, 0, {6}, {1});
    const Outcome both =
        readingOf(archiveOf(dictOf({{"0.weight", one}, {"module.0.weight", one}}), {{"0", floats(kSix)}}));
    CHECK(both.code == ErrorCode::Unsupported);
    CHECK(both.says("both '0.weight' and 'module.0.weight'"));
    // wanted names are those without
    const Bytes wrapped = archiveOf(dictOf({{"module.a", one}, {"module.b", one}}), {{"0", floats(kSix)}});
    const TorchArchive part = readTorchArchive(wrapped, "t", [](const std::string& name) { return name == "b"; });
    REQUIRE(part.tensors.size() == 1);
    CHECK(part.tensors[0].name == "b");
}

TEST_CASE("torch variants: a TorchScript module within its wrapper")
{
    const auto object = [](const std::string& type, const Members& state) {
        std::string text = "c__torch__." + type + "\n)\x81}(";
        for (const auto& [key, value] : state)
            text += text32(key) + value;
        return text + "ub";
    };
    const std::string linear = object("torch.nn.modules.linear\nLinear",
                                      {{"weight", tensorOf("0", 6, 0, {2, 3}, {3, 1})}, {"training", "\x89"}});
    const std::string network = object("torch.nn.modules.container\nSequential",
                                       {{"0", linear}, {"1", object("torch.nn.modules.activation\nReLU", {})}});
    for (const auto& [type, child] : {std::pair{"torch.nn.parallel.data_parallel\nDataParallel", "module"},
                                      {"torch._dynamo.eval_frame\nOptimizedModule", "_orig_mod"}}) {
        const TorchArchive archive =
            readTorchArchive(archiveOf(object(type, {{child, network}}), {{"0", floats(kSix)}}), "t.pt");
        CHECK(archive.is_script);
        REQUIRE(archive.tensors.size() == 1);
        CHECK(archive.tensors[0].name == "0.weight");
        using Modules = std::vector<std::pair<std::string, std::string>>;
        CHECK(archive.modules == Modules{{"0", "Linear"}, {"1", "ReLU"}});
    }
}

TEST_CASE("torch variants: other numbers are refused by their type, and only where they are wanted")
{
    for (const char* type : {"DoubleStorage", "HalfStorage", "BFloat16Storage", "LongStorage", "IntStorage",
                             "ByteStorage", "BoolStorage", "ComplexFloatStorage", "QInt8Storage"}) {
        const Bytes bytes =
            archiveOf(dictOf({{"n", tensorOf("1", 1, 0, {}, {}, type)}, {"w", tensorOf("0", 6, 0, {6}, {1})}}),
                      {{"0", floats(kSix)}, {"1", std::string(8, '\1')}});
        const Outcome outcome = readingOf(bytes);
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK(outcome.says(type));
        CHECK(readingOf(bytes, [](const std::string& name) { return name == "w"; }).message.empty());
    }
    // calls that torch.load makes: quantised, sparse, on no device, of a subclass
    for (const char* call : {"_rebuild_qtensor", "_rebuild_sparse_tensor", "_rebuild_meta_tensor_no_storage",
                             "_rebuild_tensor_v3", "_rebuild_device_tensor_from_numpy", "_rebuild_wrapper_subclass"}) {
        const Outcome outcome =
            readingOf(archiveOf(dictOf({{"w", std::string("ctorch._utils\n") + call + "\n)R"}}), {}));
        CHECK(outcome.code == ErrorCode::Unsupported);
        CHECK(outcome.says(call));
    }
    for (const char* type : {"torch.nn.modules.container\nSequential", "argparse\nNamespace", "numpy\nndarray",
                             "torch.storage\nUntypedStorage", "numpy.core.multiarray\nscalar"})
        CHECK(readingOf(archiveOf(std::string("c") + type + "\n)\x81}b", {})).code == ErrorCode::Unsupported);
}

TEST_CASE("torch variants: every protocol of pickle")
{
    const auto shortText = [](const std::string& text) { return "\x8c" + std::string(1, char(text.size())) + text; };
    // protocol 4 and 5: frames, MEMOIZE, STACK_GLOBAL
    const std::string tensor =
        shortText("torch._utils") + "\x94" + shortText("_rebuild_tensor_v2") + "\x94\x93\x94((" + shortText("storage") +
        "\x94" + shortText("torch") + "\x94" + shortText("FloatStorage") + "\x94\x93\x94" + shortText("0") + "\x94" +
        shortText("cuda:0") + "\x94" + small(6) + "t\x94Q" + small(0) + small(6) + "\x85\x94" + small(1) +
        "\x85\x94\x89" + shortText("collections") + "\x94" + shortText("OrderedDict") + "\x94\x93\x94)R\x94t\x94R";
    for (const char protocol : {'\4', '\5'}) {
        // beside it what else a dictionary may hold: bytes, sets, long integers, a memo that is used
        const std::string body = "}\x94(" + shortText("w") + "\x94" + tensor + "\x94" + shortText("b") + "C\3abc" +
                                 shortText("s") + "\x8f\x94(K\1K\2\x90" + shortText("f") + "(K\1\x91" + shortText("l") +
                                 "\x8a\x09" + std::string(9, '\1') + shortText("n") + "h\1" + shortText("o") + "N2" +
                                 "0u.";
        const std::string pickle = std::string("\x80") + protocol + "\x95" + little64(body.size()) + body;
        ZipWriter zip("a");
        zip.add("data.pkl", pickle);
        zip.add("data/0", floats(kSix));
        zip.add("version", std::string("3\n"));
        CHECK(valuesOf(zip.finish(), "w") == kSix);
    }
    // protocol 0 for all but the storage's identity
    const std::string lines = "(dS'w'\nctorch._utils\n_rebuild_tensor_v2\n((S'storage'\nctorch\nFloatStorage\nS'0'\n"
                              "Vcpu\nI6\ntQL0L\n(I6\nt(I1\ntI00\nccollections\nOrderedDict\n)RtRp1\nsS'x'\nF1.5\n"
                              "sS'y'\n(lp2\nI01\nasS'z'\ng2\nsS'l'\nL123456789012345678901234567890L\ns.";
    ZipWriter zip("a");
    zip.add("data.pkl", lines);
    zip.add("data/0", floats(kSix));
    zip.add("version", std::string("3\n"));
    CHECK(valuesOf(zip.finish(), "w") == kSix);
}

TEST_CASE("torch variants: the old container in other protocols")
{
    OldFile file;
    file.object = oldDict("w", oldTensor());
    const std::vector<float> three = {1, 2, 3};
    CHECK(valuesOf(bytesOf(file.text()), "w") == three);
    file.magic = std::string("\x80\x04\x95\x0d\0\0\0\0\0\0\0", 11) + file.magic.substr(2); // a frame of protocol 4
    CHECK(valuesOf(bytesOf(file.text()), "w") == three);
    file.magic = "L119547037146038801333356L\n."; // protocol 0 and 1
    file.protocol = "I1001\n.";
    CHECK(valuesOf(bytesOf(file.text()), "w") == three);
    file.magic = "L119547037146038801333357L\n.";
    CHECK(readingOf(bytesOf(file.text())).code == ErrorCode::InvalidFile);
}

TEST_CASE("torch variants: the zip container of other tools, and what else lies in one")
{
    const std::string pickle = "\x80\x02" + dictOf({{"w", tensorOf("0", 6, 0, {6}, {1})}}) + ".";
    const Members members = {
        {"any name/data.pkl", pickle}, {"any name/data/0", floats(kSix)}, {"any name/version", "3\n"}};
    for (const zip_int32_t method : {ZIP_CM_STORE, ZIP_CM_DEFLATE})
        CHECK(valuesOf(zipped(members, method), "w") == kSix);
    const Members newer = {{"byteorder", "little"},         {".format_version", "1"}, {".storage_alignment", "64"},
                           {".data/serialization_id", "1"}, {"code/a.py", "x"},       {"extra/note", "x"}};
    CHECK(valuesOf(archiveOf(dictOf({{"w", tensorOf("0", 6, 0, {6}, {1})}}), {{"0", floats(kSix)}}, newer), "w") ==
          kSix);
    const Outcome npz = readingOf(zipped({{"arr_0.npy", "\x93NUMPY"}}, ZIP_CM_STORE));
    CHECK(npz.code == ErrorCode::Unsupported);
    CHECK(npz.says("without data.pkl"));
    CHECK(readingOf(zipped({{"weights/opacity_mlp.pt", "PK"}}, ZIP_CM_DEFLATE)).code == ErrorCode::Unsupported);
    // cut short, and no archive at all
    Bytes cut = zipped(members, ZIP_CM_STORE);
    cut.resize(cut.size() / 2);
    CHECK(readingOf(cut).code == ErrorCode::InvalidFile);
    CHECK(readingOf(cut).says("it was cut short"));
    CHECK(readingOf({}).says("is empty"));
    for (const auto& [start, name] : {std::pair<std::string, const char*>{little64(60) + "{\"w\":{", "safetensors"},
                                      {"\x89HDF\r\n\x1a\n", "HDF5"},
                                      {"\x93NUMPY\1", "NumPy"},
                                      {"ply\nformat", "PLY"},
                                      {std::string(257, '\0') + "ustar\0", "tar archive"}}) {
        CHECK(readingOf(bytesOf(start + std::string(300, ' '))).code == ErrorCode::Unsupported);
        CHECK(readingOf(bytesOf(start + std::string(300, ' '))).says(name));
    }
}
