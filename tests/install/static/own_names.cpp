// Names of volk, of tinyobjloader and of the library's own code, as a program may have them.
extern "C" int volkInitialize() { return 1; }
extern "C" {
void* vkCreateInstance;
void* vkCmdDispatch;
}
namespace tinyobj {
int LoadMtl() { return 2; }
}  // namespace tinyobj
namespace mray {
int kVersion = 3;
}  // namespace mray
