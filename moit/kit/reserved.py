"""Words that one of the languages keeps for itself, or uses, and GLSL does not: a local of such a
name gets another, in all languages alike."""

RESERVED = frozenset(
    # HLSL and Slang
    "asm BlendState Buffer cbuffer class column_major compile DepthStencilState DomainShader "
    "dword export extern fxgroup GeometryShader groupshared half inline interface line lineadj "
    "linear matrix min16float min10float min16int min12int min16uint namespace nointerpolation "
    "noperspective pass pixelfragment point RasterizerState register row_major sample sampler "
    "shared snorm stateblock static string tbuffer technique texture triangle triangleadj "
    "typedef unorm unsigned vector vertexfragment VertexShader volatile frac lerp mad saturate "
    "extension property associatedtype var let func this where "
    # Metal and C++
    "constant device thread threadgroup kernel vertex fragment alignas auto catch char delete "
    "double enum explicit friend goto long mutable new operator private protected public short "
    "signed sizeof template try typename union using virtual metal "
    # WGSL
    "fn alias diagnostic enable loop override requires NULL Self abstract active as async await "
    "become binding_array checked co_await coherent concept const_cast crate debugger demote do "
    "dynamic_cast final finally from fx get handle highp impl implements import instanceof "
    "invariant lowp macro match mediump meta mod module move mut nil non_coherent noncoherent "
    "null of package packoffset partition patch pointer precision pub ref regardless resource "
    "self set smooth subroutine super target throw trait type undefined unless unsafe unsized "
    "use varying wgsl with writeonly yield ptr array atomic select ".split()
)
