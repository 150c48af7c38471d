(function(){"use strict";const Q=`
#define ROW 44
#define EDGE 1e-6
layout(std140) uniform Edits { vec4 rows[1024]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and how far off that is.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at, p - rows[at + 3].xyz);
  vec3 xi = y;
  error = 0.0;
  if (rows[at].w < 0.5) {
    if (inBox(y, rows[at + 4].xyz, rows[at + 5].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + 6, xi, bent(at + 6, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + 6, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at, v);
  int c = at + 10;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
  if (rows[at].w < 0.5) {
    along = bendSolve(at + 6, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & 2047, n >> ${Math.log2(2048)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + 3, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + 6].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Takes a sample through the edit whose numbers begin at a row; true where it was emptied.
bool mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + 3].w > 0.5;
  int resolution_ = int(rows[e + 2].w);
  int first = e + 8;
  if (rows[e + 4].w > 0.5) {
    vec3 y = times(first, p - rows[first + 3].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return false;
    }
    vec3 at = times(e + 3, p - rows[e + 2].xyz);
    if (inBox(at, rows[e + 6].xyz, rows[e + 7].xyz)) interpolate(e, resolution_, at, p, v);
    return false;
  }
  float error;
  if (rows[e].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return false;
    }
  }
  if (rows[e + 1].w < 1.5) return false;
  hexahedron(p, first + 18, error);
  if (!continuous) return error <= EDGE;
  if (error <= EDGE) interpolate(e, resolution_, times(e + 3, p - rows[e + 2].xyz), p, v);
  return false;
}

MAP_SAMPLE
// The part of a ray outside which no edit changes anything.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * ROW + 2 * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`,ee=2;function te(i){return i<=ee?i:null}function re(i){const e=n=>`if (inBox(p, rows[${n}].xyz, rows[${n} + 1].xyz) && mapEdit(${n}, p, v)) return true;`,r=["bool mapSample(inout vec3 p, inout vec3 v) {",...(i===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * ROW")} }`]:Array.from({length:i},(n,s)=>e(`${i-1-s} * ROW`))).map(n=>`  ${n}`),"  return false;","}"];return Q.replace("MAP_SAMPLE",`${r.join(`
`)}
`)}function F(i,e,t){const r=performance.now(),n=i.createProgram();for(const[a,c]of[[i.VERTEX_SHADER,e],[i.FRAGMENT_SHADER,t]]){const l=i.createShader(a);if(l===null)throw new Error("the GPU's context is lost");i.shaderSource(l,c),i.compileShader(l),i.attachShader(n,l),i.deleteShader(l)}if(i.linkProgram(n),!i.getProgramParameter(n,i.LINK_STATUS)&&!i.isContextLost()){const c=(i.getAttachedShaders(n)??[]).map(l=>i.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${i.getProgramInfoLog(n)??""}`)}const s=new Map;return{program:n,uniform:a=>{const c=s.get(a);if(c!==void 0)return c;const l=i.getUniformLocation(n,a);return s.set(a,l),l},milliseconds:performance.now()-r}}class ie extends Error{constructor(){super("the GPU has not enough memory for the field")}}function z(i){for(let e=i.getError();e!==i.NO_ERROR&&e!==i.CONTEXT_LOST_WEBGL;e=i.getError())if(e===i.OUT_OF_MEMORY)throw new ie}function _(i,e,t,r){const n=i.createTexture();i.bindTexture(i.TEXTURE_3D,n),i.texStorage3D(i.TEXTURE_3D,1,e,t[0],t[1],t[2]),k(i,i.TEXTURE_3D,r);try{z(i)}catch(s){throw i.deleteTexture(n),s}return n}function k(i,e,t){i.texParameteri(e,i.TEXTURE_MIN_FILTER,t),i.texParameteri(e,i.TEXTURE_MAG_FILTER,t);for(const r of e===i.TEXTURE_3D?[i.TEXTURE_WRAP_S,i.TEXTURE_WRAP_T,i.TEXTURE_WRAP_R]:[i.TEXTURE_WRAP_S,i.TEXTURE_WRAP_T])i.texParameteri(e,r,i.CLAMP_TO_EDGE)}function A(i){i.bindBuffer(i.PIXEL_UNPACK_BUFFER,null),i.pixelStorei(i.UNPACK_ALIGNMENT,1),i.pixelStorei(i.UNPACK_FLIP_Y_WEBGL,!1),i.pixelStorei(i.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),i.pixelStorei(i.UNPACK_COLORSPACE_CONVERSION_WEBGL,i.NONE);for(const e of[i.UNPACK_ROW_LENGTH,i.UNPACK_IMAGE_HEIGHT,i.UNPACK_SKIP_PIXELS,i.UNPACK_SKIP_ROWS,i.UNPACK_SKIP_IMAGES])i.pixelStorei(e,0)}class ne{constructor(e){this.gl=e}uploaded={last:0,total:0};current=null;buffer=null;lattices=null;occupancy=null;get edits(){return this.current}get bricks(){return this.occupancy?.texture??null}set(e){if(this.uploaded.last=0,e===null||e.edits===0){this.dispose();return}if(e.rows.length>4*1024)throw new Error("more edits than the page's shader holds");this.putRows(e),this.putLattices(e),this.putOccupancy(e),this.current=e,this.uploaded.total+=this.uploaded.last}bind(e){const{gl:t}=this;return t.uniformBlockBinding(e,t.getUniformBlockIndex(e,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,this.buffer),this.lattices?.texture??null}forget(){this.current=this.buffer=this.lattices=this.occupancy=null}dispose(){const{gl:e}=this;e.deleteBuffer(this.buffer),e.deleteTexture(this.lattices?.texture??null),e.deleteTexture(this.occupancy?.texture??null),this.forget()}putRows({rows:e}){const{gl:t}=this,r=this.buffer===null;this.buffer??=t.createBuffer(),t.bindBuffer(t.UNIFORM_BUFFER,this.buffer),r&&t.bufferData(t.UNIFORM_BUFFER,16*1024,t.DYNAMIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e),t.bindBuffer(t.UNIFORM_BUFFER,null),this.uploaded.last+=e.byteLength}putLattices({lattices:e}){const{gl:t}=this,r=e.map(({halves:c})=>Math.ceil(c.length/(3*2048))),n=Math.max(1,r.reduce((c,l)=>c+l,0));if(n>t.getParameter(t.MAX_TEXTURE_SIZE))throw new Error("the edits' lattices do not fit into a texture of the GPU");(this.lattices===null||n>this.lattices.rows)&&(t.deleteTexture(this.lattices?.texture??null),this.lattices={texture:this.latticeTexture(n),rows:n,placed:[]});const{texture:s,placed:o}=this.lattices;A(t),t.bindTexture(t.TEXTURE_2D,s);let a=0;this.lattices.placed=e.map(({key:c,halves:l},f)=>{const u={key:c,row:a};if(o.every(h=>h.key!==c||h.row!==u.row)){const h=6144*r[f],d=l.length===h?l:new Uint16Array(h);d!==l&&d.set(l),t.texSubImage2D(t.TEXTURE_2D,0,0,a,2048,r[f],t.RGB,t.HALF_FLOAT,d),this.uploaded.last+=d.byteLength}return a+=r[f],u}),t.bindTexture(t.TEXTURE_2D,null),z(t)}latticeTexture(e){const{gl:t}=this,r=t.createTexture();return t.bindTexture(t.TEXTURE_2D,r),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,2048,e),k(t,t.TEXTURE_2D,t.NEAREST),r}putOccupancy({occupancy:{key:e,dims:t,codes:r,changed:n}}){const{gl:s,occupancy:o}=this;if(o?.key===e)return;A(s);const a=o!==null&&o.dims.every((d,x)=>d===t[x]);a||s.deleteTexture(o?.texture??null);const c=a?o.texture:_(s,s.R16UI,[t[2],t[1],t[0]],s.NEAREST),l=a&&n?.of===o.key?n:{low:[0,0,0],dims:t,codes:r};s.bindTexture(s.TEXTURE_3D,c);const[f,u,h]=l.low;s.texSubImage3D(s.TEXTURE_3D,0,h,u,f,l.dims[2],l.dims[1],l.dims[0],s.RED_INTEGER,s.UNSIGNED_SHORT,l.codes),s.bindTexture(s.TEXTURE_3D,null),this.occupancy={texture:c,key:e,dims:t},this.uploaded.last+=l.codes.byteLength}}class P extends Error{}function se(i,e){const t=i.field.brick,r=t+1,n=i.header.resolution.map(h=>Math.ceil((h-1)/t)),s=ae(i,n),o=Math.min(255,Math.floor(e/r)),a=Math.min(o,Math.max(1,Math.ceil(Math.cbrt(s.length)))),c=Math.min(o,Math.max(1,Math.ceil(Math.sqrt(s.length/a)))),l=Math.max(1,Math.ceil(s.length/(a*c)));if(l>o)throw new P(`${s.length} bricks do not fit into textures of ${e} texels an edge`);const f=new Uint8Array(4*n[0]*n[1]*n[2]);for(const[h,d]of s.entries())f.set([h%a,Math.floor(h/a)%c,Math.floor(h/(a*c)),255],4*d);const u=Math.ceil(3*i.header.steps.length/4);return{brick:t,edge:r,dims:n,across:[a,c,l],count:s.length,index:f,bricks:s,colours:u}}function oe({across:i,edge:e,colours:t,index:r}){return i[0]*i[1]*i[2]*e**3*(2+4*t)+r.length}function ae(i,e){const{codes:t,dims:r}=i.occupancy,n=i.field.brick/4,s=new Uint8Array(e[0]*e[1]*e[2]);let o=0;for(let a=0;a<r[0];a++)for(let c=0;c<r[1];c++)for(let l=0;l<r[2];l++,o++)t[o]<256&&(s[(Math.floor(a/n)*e[1]+Math.floor(c/n))*e[2]+Math.floor(l/n)]=1);return Int32Array.from(s.keys()).filter(a=>s[a]===1)}class ce{constructor(e,t){this.level=e,this.layout=t;const{brick:r}=t;this.wire=e.header.resolution.map(a=>Math.ceil(a/r));const n=r**3;this.numbers=new Int32Array(e.bricks.length).fill(-1),this.slots=new Int32Array(e.masks.length/(n/8)*n).fill(-1);let s=0;e.bricks.forEach((a,c)=>{a&&(this.numbers[c]=s++)});let o=0;for(let a=0;a<this.slots.length;a++)e.masks[a>>3]>>(a&7)&1&&(this.slots[a]=o++)}slots;numbers;wire;layer(e){const{across:t,edge:r,count:n,colours:s,bricks:o}=this.layout,a=t[0]*t[1]*r**3,c={density:new Uint16Array(a),colours:Array.from({length:s},()=>new Uint8Array(4*a).fill(128))},l=e*t[0]*t[1],f=new Int32Array(r**3);for(let u=l;u<Math.min(n,l+t[0]*t[1]);u++)this.vertices(o[u],f),this.put(c,u-l,f);return c}vertices(e,t){const{dims:r,brick:n,edge:s}=this.layout,o=[Math.floor(e/(r[1]*r[2])),Math.floor(e/r[2])%r[1],e%r[2]];let a=0;for(let c=0;c<s;c++)for(let l=0;l<s;l++)for(let f=0;f<s;f++,a++){const u=c<n?o[0]:o[0]+1,h=l<n?o[1]:o[1]+1,d=f<n?o[2]:o[2]+1;if(t[a]=-1,u>=this.wire[0]||h>=this.wire[1]||d>=this.wire[2])continue;const x=this.numbers[(u*this.wire[1]+h)*this.wire[2]+d];x>=0&&(t[a]=this.slots[((x*n+c%n)*n+l%n)*n+f%n])}}put(e,t,r){const{across:n,edge:s}=this.layout,{density:o,sh:a,header:c}=this.level,l=n[0]*s,f=l*n[1]*s,u=t%n[0]*s+Math.floor(t/n[0])*s*l,h=3*c.steps.length;let d=0;for(let x=0;x<s;x++)for(let m=0;m<s;m++)for(let v=0;v<s;v++,d++){const p=r[d];if(p<0)continue;const y=u+x*f+m*l+v;e.density[y]=o[p];for(let E=0;E<h;E++)e.colours[E>>2][4*y+(E&3)]=a[E*c.vertices+p]}}}async function le(i,e,t,r){const n=se(e,i.getParameter(i.MAX_3D_TEXTURE_SIZE)),s=oe(n);if(s>t)throw new P(`the field takes ${Math.ceil(s/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);const{across:o,edge:a,dims:c}=n,l=o.map(u=>u*a),f=[];try{const u=_(i,i.R16F,l,i.LINEAR);f.push(u);const h=Array.from({length:n.colours},()=>{const m=_(i,i.RGBA8,l,i.LINEAR);return f.push(m),m}),d=new ce(e,n);for(let m=0;m<o[2];m++){const v=d.layer(m);A(i);const p=(y,E,U,B)=>{i.bindTexture(i.TEXTURE_3D,y),i.texSubImage3D(i.TEXTURE_3D,0,0,0,m*a,l[0],l[1],a,E,U,B)};if(p(u,i.RED,i.HALF_FLOAT,v.density),v.colours.forEach((y,E)=>p(h[E],i.RGBA,i.UNSIGNED_BYTE,y)),i.bindTexture(i.TEXTURE_3D,null),await new Promise(y=>setTimeout(y)),!r())throw new Error("not wanted any more")}A(i);const x=_(i,i.RGBA8UI,[c[2],c[1],c[0]],i.NEAREST);return f.push(x),i.texSubImage3D(i.TEXTURE_3D,0,0,0,0,c[2],c[1],c[0],i.RGBA_INTEGER,i.UNSIGNED_BYTE,n.index),i.bindTexture(i.TEXTURE_3D,null),z(i),{layout:n,density:u,colours:h,index:x,bytes:s}}catch(u){for(const h of f)i.deleteTexture(h);if(!r())return null;throw u}}function G(i,{dims:e,codes:t}){A(i);const r=_(i,i.R16UI,[e[2],e[1],e[0]],i.NEAREST);return i.texSubImage3D(i.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],i.RED_INTEGER,i.UNSIGNED_SHORT,t),i.bindTexture(i.TEXTURE_3D,null),r}function he(i,e){for(const t of[e.density,e.index,...e.colours])i.deleteTexture(t)}class X{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}held=[];length=0;arrived=0;source;async take(e){for(;this.length<e;){const{value:n,done:s}=await this.source.read();if(s)throw new Error("the file of the field is truncated");this.held.push(n),this.length+=n.length,this.arrived+=n.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let r=0;for(;r<e;){const n=this.held[0],s=n.subarray(0,e-r);t.set(s,r),r+=s.length,s.length===n.length?this.held.shift():this.held[0]=n.subarray(s.length)}return this.length-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function ue(i){const e=new Blob([i]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class D{constructor(e,t,r){this.header=e,this.entries=t,this.reader=r}next=0;static async open(e,t,r){const n=await e.take(16),s=new DataView(n.buffer);if(String.fromCharCode(...n.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const o=s.getUint32(8,!0);if(o!==r)throw new Error(`"${t}" of version ${o}, this page reads ${r}; reload it`);const a=new TextDecoder().decode(await e.take(s.getUint32(12,!0))),c=JSON.parse(a);return new D(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const r=await ue(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(r);case"u2":return new Uint16Array(r);case"i4":return new Int32Array(r);case"f4":return new Float32Array(r)}}}const fe="cagepage",de=1;async function*me(i,e){const t=new X(i,e);try{const r=await D.open(t,fe,de);for(const[n,s]of r.header.levels.entries()){const o=await r.read(`${n}.bricks`),a=await r.read(`${n}.masks`),c=await r.read(`${n}.occupancy`),l=await r.read(`${n}.density`),f=await r.read(`${n}.sh`);yield{field:r.header,header:s,last:n===r.header.levels.length-1,bricks:o,masks:a,density:$(l),sh:xe(f,s.vertices),occupancy:{origin:[0,0,0],dims:s.dims,codes:c}}}}finally{t.cancel()}}function $(i){const e=i.length/2,t=new Uint16Array(e);for(let r=0;r<e;r++)t[r]=i[r]|i[e+r]<<8;return t}function xe(i,e){for(let t=0;t<i.length;t+=e){let r=128;for(let n=t;n<t+e;n++)i[n]=r=r+i[n]&255}return i}const pe=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)"];function ve(i){const e=Math.ceil(3*i/4),t=[`uniform float coefficientSteps[${i}];`,...Array.from({length:e},(r,n)=>`uniform sampler3D colourAtlas${n};`),"vec3 colourAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(r,n)=>`  vec4 s${n} = 255.0 * textureLod(colourAtlas${n}, at, 0.0) - 128.0;`)];for(let r=0;r<i;r++){const n=[0,1,2].map(s=>`s${3*r+s>>2}.${"xyzw"[3*r+s&3]}`);t.push(`  rgb += (coefficientSteps[${r}] * (${pe[r]})) * vec3(${n.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colours:e}}const C=`#version 300 es
void main() {
  vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 0.0, 1.0);
}`,ye=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// The texel, whole where a vertex is, of grid coordinates in the atlas; false where their brick is empty.
bool locate(vec3 g, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 place = texelFetch(brickIndex, b.zyx, 0);
  corner = ivec3(place.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return place.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,Ee=`
// Rounded here, and put amid the step: some GPUs cut off where others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      bool emptied = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (emptied) alive = false;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colourAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLOURS;
#endif
          rgb += w * clamp(c, 0.0, 1.0);
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColour = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function we(i,e){const{source:t,colours:r}=ve(i.K),n=[`#define BRICK ${e}`,`#define COLOURS ${r}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return i.contracted&&n.push("#define CONTRACTED"),i.edited&&n.push("#define EDITED"),i.normals&&n.push("#define NORMALS"),i.count&&n.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...n,ye,t,i.edited?re(i.edits):"",Ee].join(`
`)}function Te(i,e,t,r,n,s){const{bounds:o,contracted:a}=t.field,{resolution:c,unit:l,steps:f}=t.header,{across:u,edge:h,dims:d}=r,m=o[1].map((p,y)=>p-o[0][y]).map((p,y)=>a?2/p:(c[y]-1)/p),v=o[0].map((p,y)=>a?.5*(p+o[1][y]):p);i.uniform3f(e("atlasScale"),1/(u[0]*h),1/(u[1]*h),1/(u[2]*h)),i.uniform3i(e("indexDims"),...d),i.uniform3i(e("bricksOrigin"),...n.origin),i.uniform3i(e("bricksDims"),...n.dims),i.uniform3i(e("resolution"),...c),i.uniform3fv(e("lower"),v),i.uniform3fv(e("scale"),m),i.uniform3fv(e("halfGrid"),c.map(p=>(p-1)/4)),i.uniform1f(e("unit"),l),i.uniform1f(e("marchStep"),a?s:s/Math.max(...m)),i.uniform1fv(e("coefficientSteps"),f)}function ge(i,e,t,{width:r,height:n}){const{c2w:s}=t,o=r/t.width,a=n/t.height;i.uniform3f(e("eye"),s[3],s[7],s[11]),i.uniformMatrix3fv(e("rotation"),!0,[s[0],s[1],s[2],s[4],s[5],s[6],s[8],s[9],s[10]]),i.uniform4f(e("lens"),t.fx*o,t.fy*a,t.cx*o,t.cy*a),i.uniform1f(e("height"),n)}class be{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get colour(){return this.textures?.colour??null}get normals(){return this.textures?.normals??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={colour:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{colour:r,depth:n,normals:s}=this.textures;for(const[o,a]of[r,n,s].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+o,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:r,height:n}=this,s=new Uint8Array(4*r*n),o=e&&this.textures?.normals?new Uint8Array(4*r*n):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,r,n,t.RGBA,t.UNSIGNED_BYTE,s),o&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,r,n,t.RGBA,t.UNSIGNED_BYTE,o)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=N(this.readDepth(),r);return{width:r,height:n,rgba:N(s,4*r),depth:a,normals:o&&N(o,4*r)}}readBits(e,t){const{gl:r}=this,n=new Uint32Array(e*t);if(r.bindBuffer(r.PIXEL_PACK_BUFFER,null),r.pixelStorei(r.PACK_ALIGNMENT,1),r.getParameter(r.IMPLEMENTATION_COLOR_READ_FORMAT)===r.RED_INTEGER)r.readPixels(0,0,e,t,r.RED_INTEGER,r.UNSIGNED_INT,n);else{const s=new Uint32Array(4*e*t);r.readPixels(0,0,e,t,r.RGBA_INTEGER,r.UNSIGNED_INT,s);for(let o=0;o<n.length;o++)n[o]=s[4*o]}return new Float32Array(n.buffer)}wait(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.readBuffer(e.COLOR_ATTACHMENT0),e.readPixels(0,0,1,1,e.RGBA,e.UNSIGNED_BYTE,new Uint8Array(4)),e.bindFramebuffer(e.FRAMEBUFFER,null)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const r of Object.values(t))e.deleteTexture(r);e.deleteFramebuffer(this.framebuffer),this.forget()}readDepth(){const{gl:e}=this;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.readBuffer(e.COLOR_ATTACHMENT1);const t=this.readBits(this.width,this.height);return e.bindFramebuffer(e.FRAMEBUFFER,null),t}texture(e,t){const{gl:r}=this,n=r.createTexture();return r.bindTexture(r.TEXTURE_2D,n),r.texStorage2D(r.TEXTURE_2D,1,e,this.width,this.height),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MIN_FILTER,t),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MAG_FILTER,t),r.bindTexture(r.TEXTURE_2D,null),n}}function N(i,e){const t=i.length/e;for(let r=0;r<t>>1;r++){const[n,s]=[r*e,(t-1-r)*e],o=i.slice(n,n+e);i.copyWithin(n,s,s+e),i.set(o,s)}return i}const I=["colour","depth","opacity","normals"],Re=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform sampler2D normals;
uniform vec2 size;
uniform vec2 reach;
uniform int view;
out vec4 colour;
void main() {
  vec2 at = gl_FragCoord.xy / size;
  vec4 c = texture(picture, at);
  if (view == ${I.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${I.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${I.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  colour = vec4(c.rgb, 1.0);
}`,_e=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform int stride;
uniform int height;
out uint bits;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) * stride;
  at.y = height - 1 - at.y;
  bits = texelFetch(picture, at, 0).a > 0.5 ? texelFetch(depthBits, at, 0).r : 0x7f800000u;
}`;class Ae{constructor(e,t){this.gl=e,this.targets=t}programs=null;small=null;show(e,t,r,n){const{gl:s}=this,{program:o,uniform:a}=this.cached.show;s.viewport(0,0,r,n),s.useProgram(o),this.bind(a),s.activeTexture(s.TEXTURE2),s.bindTexture(s.TEXTURE_2D,this.targets.normals),s.uniform1i(a("normals"),2),s.uniform2f(a("size"),r,n),s.uniform2f(a("reach"),...t),s.uniform1i(a("view"),I.indexOf(e)),s.drawArrays(s.TRIANGLES,0,3)}distances(e){const{gl:t,targets:r}=this,n=Math.max(1,Math.ceil(Math.sqrt(r.width*r.height/e))),[s,o]=[Math.ceil(r.width/n),Math.ceil(r.height/n)];this.bindSmall(s,o);const{program:a,uniform:c}=this.cached.distances;return t.viewport(0,0,s,o),t.useProgram(a),this.bind(c),t.uniform1i(c("stride"),n),t.uniform1i(c("height"),r.height),t.drawArrays(t.TRIANGLES,0,3),t.readBuffer(t.COLOR_ATTACHMENT0),{width:s,height:o,values:r.readBits(s,o)}}forget(){this.programs=this.small=null}dispose(){const{gl:e}=this;for(const{program:t}of Object.values(this.programs??{}))e.deleteProgram(t);e.deleteTexture(this.small?.texture??null),e.deleteFramebuffer(this.small?.framebuffer??null),this.forget()}get cached(){return this.programs??={show:F(this.gl,C,Re),distances:F(this.gl,C,_e)},this.programs}bind(e){const{gl:t,targets:r}=this;t.activeTexture(t.TEXTURE0),t.bindTexture(t.TEXTURE_2D,r.colour),t.uniform1i(e("picture"),0),t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,r.depth),t.uniform1i(e("depthBits"),1)}bindSmall(e,t){const{gl:r}=this;if(this.small?.width!==e||this.small.height!==t){r.deleteTexture(this.small?.texture??null),r.deleteFramebuffer(this.small?.framebuffer??null);const n=r.createTexture();r.bindTexture(r.TEXTURE_2D,n),r.texStorage2D(r.TEXTURE_2D,1,r.R32UI,e,t);const s=r.createFramebuffer();r.bindFramebuffer(r.FRAMEBUFFER,s),r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0,r.TEXTURE_2D,n,0),this.small={texture:n,framebuffer:s,width:e,height:t}}r.bindFramebuffer(r.FRAMEBUFFER,this.small.framebuffer),r.drawBuffers([r.COLOR_ATTACHMENT0])}}const Me=768*2**20;class H{constructor(e,t=Me){this.gl=e,this.memory=t,this.targets=new be(e),this.views=new Ae(e,this.targets),this.onGpu=new ne(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;compileTime=0;compiled=0;shown=null;onGpu;views;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shown?.level??null}get uploaded(){return this.onGpu.uploaded}get active(){return this.edited?this.onGpu.edits:null}get bytes(){return this.shown?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const r=++this.loading,n=()=>r===this.loading;let s=0;for await(const o of me(e,t.onArrival)){if(await this.take(o,n),!n())return;t.onLevel?.(++s,o.field.levels.length)}}async restore(){const{shown:e}=this,{edits:t}=this.onGpu;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shown=null;for(const n of[this.targets,this.views,this.onGpu])n.forget();const r=++this.loading;e&&await this.take(e.level,()=>r===this.loading),this.setEdits(t)}setEdits(e){this.onGpu.set(e)}render(e={}){const{gl:t,shown:r,camera:n,active:s}=this;if(!r||!n||t.isContextLost())return!1;const{level:o,textures:a}=r,{width:c,height:l}=this.targets,f={K:o.header.steps.length,contracted:o.field.contracted,edited:s!==null,edits:s&&te(s.edits),normals:e.normals??!1,count:e.count??!1},{program:u,uniform:h}=this.program(f,o.field.brick);this.targets.bind(f.normals),t.useProgram(u),t.bindVertexArray(this.vertices),this.plainState();const d=s&&o.last?s.occupancy:o.occupancy;Te(t,h,o,a.layout,d,this.step??o.field.step),ge(t,h,n,this.targets),t.uniform1f(h("near"),this.near),t.uniform3f(h("background"),...this.background);let x=0;const m=(E,U,B)=>{t.activeTexture(t.TEXTURE0+x),t.bindTexture(U,B),t.uniform1i(h(E),x++)};m("densityAtlas",t.TEXTURE_3D,a.density),m("brickIndex",t.TEXTURE_3D,a.index),m("bricks",t.TEXTURE_3D,s?this.deformed(r):r.occupancy),a.colours.forEach((E,U)=>m(`colourAtlas${U}`,t.TEXTURE_3D,E)),s&&(m("lattice",t.TEXTURE_2D,this.onGpu.bind(u)),t.uniform1i(h("editCount"),s.edits),t.uniform1i(h("boxCount"),s.boxes),t.uniform1i(h("preserveOpacity"),Number(s.preserveOpacity)));const{first:v,count:p}=e.rows??{first:0,count:l},y=e.columns??{first:0,count:c};return t.enable(t.SCISSOR_TEST),t.scissor(y.first,v,y.count,p),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),this.unbind(),!0}show(e,t,r=null,n="colour"){const{gl:s}=this;s.bindFramebuffer(s.FRAMEBUFFER,r),s.bindVertexArray(this.vertices),this.plainState(),this.views.show(n,this.reach,e,t),this.unbind()}read(e=!1){return this.targets.read(e)}distances(e){this.gl.bindVertexArray(this.vertices),this.plainState();const t=this.views.distances(e);return this.unbind(),t}wait(){this.targets.wait()}dispose(){this.loading++,this.drop();for(const e of[this.targets,this.views,this.onGpu])e.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const r=await le(this.gl,e,this.memory,t);r!==null&&(this.drop(),this.shown={level:e,textures:r,occupancy:G(this.gl,e.occupancy),solid:null})}drop(){this.shown&&(he(this.gl,this.shown.textures),this.gl.deleteTexture(this.shown.occupancy),this.gl.deleteTexture(this.shown.solid),this.shown=null)}deformed(e){if(e.level.last)return this.onGpu.bricks;const{occupancy:t}=e.level;return e.solid??=G(this.gl,{...t,codes:new Uint16Array(t.codes.length).fill(255)}),e.solid}get reach(){const{shown:e,camera:t}=this;if(!e||!t)return[0,1];const[r,n]=e.level.field.bounds,s=.5*Math.hypot(...n.map((a,c)=>a-r[c])),o=Math.hypot(...n.map((a,c)=>.5*(a+r[c])-t.c2w[4*c+3]));return[Math.max(0,o-s),o+s]}program(e,t){const r=JSON.stringify([e,t]);let n=this.programs.get(r);return n||(n=F(this.gl,C,we(e,t)),this.programs.set(r,n),this.compileTime=n.milliseconds,this.compiled+=1),n}plainState(){const{gl:e}=this;for(const t of[e.BLEND,e.DEPTH_TEST,e.CULL_FACE,e.STENCIL_TEST,e.SCISSOR_TEST,e.DITHER])e.disable(t);e.colorMask(!0,!0,!0,!0),e.depthMask(!1)}unbind(){const{gl:e}=this;for(let t=15;t>=0;t--)e.activeTexture(e.TEXTURE0+t),e.bindTexture(e.TEXTURE_2D,null),e.bindTexture(e.TEXTURE_3D,null);e.bindVertexArray(null),e.bindFramebuffer(e.FRAMEBUFFER,null),e.useProgram(null)}}async function W(i,e=null){const t=await D.open(new X(i),"cageedit",2),{header:r}=t,n=await t.read("rows"),s=[];for(const[h,{key:d}]of r.lattices.entries()){const x=[...s,...e?.lattices??[]].find(m=>m.key===d);s.push(x??{key:d,halves:$(await t.read(`lattice.${h}`))})}const{key:o,origin:a,dims:c,part:l}=r.occupancy,f=e?.occupancy??null;let u;if(f?.key===o)u=f;else{const h=await t.read("occupancy");if(l===null)u={key:o,origin:a,dims:c,codes:h,changed:null};else if(f?.key===l.of)u={key:o,origin:a,dims:c,codes:Se(f,l.low,l.dims,h),changed:{...l,codes:h}};else throw new Error("the edits are the change of ones that this page has not")}return{edits:r.edits,boxes:r.boxes,preserveOpacity:r.preserve_opacity,rows:n,lattices:s,occupancy:u}}function Se({dims:i,codes:e},t,r,n){const s=e.slice();let o=0;for(let a=t[0];a<t[0]+r[0];a++)for(let c=t[1];c<t[1]+r[1];c++,o+=r[2])s.set(n.subarray(o,o+r[2]),(a*i[1]+c)*i[2]+t[2]);return s}const L=[1,.75,.5,.35,.25,.18,.12];class Ue{constructor(e=28,t=40){this.moving=e,this.part=t}cost=null;took(e,t){const r=t/Math.max(1,e);this.cost=this.cost===null?r:this.cost+.3*(r-this.cost)}scale(e,t){const{cost:r}=this;return r===null?.25:L.find(n=>r*e*t*n*n<=this.moving)??L[L.length-1]}rows(e,t){return this.cost===null?16:Math.max(4,Math.min(t,Math.floor(this.part/Math.max(1e-9,this.cost*e))))}}async function De(i){const e=performance.now(),t=i.fenceSync(i.SYNC_GPU_COMMANDS_COMPLETE,0);if(i.flush(),t===null)return 0;for(;!i.isContextLost()&&i.clientWaitSync(t,0,0)===i.TIMEOUT_EXPIRED;)await new Promise(r=>setTimeout(r,1));return i.deleteSync(t),performance.now()-e}function Ie(i,e){const t=new Map;i.style.touchAction="none",i.addEventListener("contextmenu",r=>r.preventDefault()),i.addEventListener("pointerdown",r=>{i.setPointerCapture(r.pointerId),t.set(r.pointerId,{x:r.clientX,y:r.clientY,shifts:r.button!==0||r.shiftKey})});for(const r of["pointerup","pointercancel"])i.addEventListener(r,n=>t.delete(n.pointerId));i.addEventListener("pointermove",r=>{const n=t.get(r.pointerId);if(!n)return;const[s,o]=[r.clientX-n.x,r.clientY-n.y],a=[...t.entries()].find(([c])=>c!==r.pointerId)?.[1];if(a){const c=Math.hypot(n.x-a.x,n.y-a.y),l=Math.hypot(r.clientX-a.x,r.clientY-a.y);e.shift(s/2,o/2),c>1&&l>1&&e.zoom(c/l)}else n.shifts?e.shift(s,o):e.turn(s,o);n.x=r.clientX,n.y=r.clientY}),i.addEventListener("wheel",r=>{r.preventDefault();const n=r.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;e.zoom(Math.exp(.0012*n*r.deltaY))},{passive:!1})}const w=(i,e,t=1)=>[i[0]+t*e[0],i[1]+t*e[1],i[2]+t*e[2]],T=(i,e)=>w(i,e,-1),O=(i,e)=>[e*i[0],e*i[1],e*i[2]],b=(i,e)=>i[0]*e[0]+i[1]*e[1]+i[2]*e[2],M=(i,e)=>[i[1]*e[2]-i[2]*e[1],i[2]*e[0]-i[0]*e[2],i[0]*e[1]-i[1]*e[0]],q=i=>Math.hypot(...i),R=i=>O(i,1/Math.max(1e-30,q(i)));function V(i,e,t){const[r,n]=[Math.cos(t),Math.sin(t)];return w(w(O(i,r),M(e,i),n),e,b(e,i)*(1-r))}const g=(i,e)=>[i[e],i[4+e],i[8+e]];function K(i,e,t,r){return[0,1,2].flatMap(n=>[i[n],e[n],t[n],r[n]]).concat(0,0,0,1)}const Y=.02;class j{constructor(e,t,r){this.up=t,this.eye=g(e,3);const n=O(g(e,2),-1);this.target=w(this.eye,n,Math.max(b(T(r,this.eye),n),.001))}eye;target;get c2w(){const e=R(T(this.eye,this.target)),t=R(M(this.up,e));return K(t,M(e,t),e,this.eye)}turn(e,t){const r=V(T(this.eye,this.target),this.up,-e),n=R(M(this.up,r)),s=Math.acos(Math.max(-1,Math.min(1,b(R(r),this.up)))),o=Math.max(Y,Math.min(Math.PI-Y,s-t))-s;this.eye=w(this.target,V(r,n,o))}shift(e,t,r){const n=2*r*q(T(this.eye,this.target)),{c2w:s}=this,o=w(O(g(s,0),-e*n),g(s,1),t*n);this.eye=w(this.eye,o),this.target=w(this.target,o)}zoom(e){this.eye=w(this.target,T(this.eye,this.target),e)}}function Oe({stills:i,seconds:e,loop:t},r){const n=e>0?r/e:1,s=i.length-1,o=t?n%1*i.length:Math.min(n,1)*s,a=i[Math.min(Math.floor(o),s)],c=i[t?(Math.floor(o)+1)%i.length:Math.min(Math.floor(o)+1,s)],l=o-Math.floor(o),f=x=>w(g(a.c2w,x),T(g(c.c2w,x),g(a.c2w,x)),l),u=R(f(2)),h=f(1),d=R(T(h,[u[0]*b(h,u),u[1]*b(h,u),u[2]*b(h,u)]));return{c2w:K(M(d,u),d,u,f(3)),fov_y_deg:a.fov_y_deg+l*(c.fov_y_deg-a.fov_y_deg)}}const Fe=120,ze=2;class Ce{constructor(e,t,r){this.canvas=e,this.header=t,this.say=r;const n=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!n)throw new Error("This browser has no WebGL2, which the scene is drawn with.");this.gl=n,this.renderer=new H(n),this.renderer.background=t.background??[1,1,1],this.orbit=new j(t.start.c2w,t.up,t.centre),this.fov=t.start.fov_y_deg,Ie(e,{turn:(s,o)=>this.change(()=>this.orbit.turn(Math.PI*s/e.clientHeight,Math.PI*o/e.clientHeight)),shift:(s,o)=>this.change(()=>this.orbit.shift(s/e.clientHeight,o/e.clientHeight,this.tangent)),zoom:s=>this.change(()=>this.orbit.zoom(s))}),e.addEventListener("webglcontextlost",s=>s.preventDefault()),e.addEventListener("webglcontextrestored",()=>void this.renderer.restore().then(()=>this.touch())),new ResizeObserver(()=>this.touch()).observe(e)}renderer;orbit;gl;pacing=new Ue;fov;moved=performance.now();row=0;playing=null;async run(e,t){t&&this.renderer.setEdits(await W(t)),this.draw(),await this.renderer.load(e,{onLevel:(r,n)=>{this.say(r<n?"Loading detail …":""),this.touch()}})}get whole(){return this.row===null}get edited(){return this.renderer.edited}set edited(e){this.renderer.edited=e,this.touch()}get plays(){return this.playing!==null}play(e){this.playing=e&&this.header.path?performance.now():null,this.touch()}home(){this.look(this.header.start),this.playing=null}get tangent(){return Math.tan(this.fov*Math.PI/360)}look(e){this.orbit=new j(e.c2w,this.header.up,this.header.centre),this.fov=e.fov_y_deg,this.touch()}change(e){this.playing=null,e(),this.touch()}touch(){this.moved=performance.now(),this.row=0}async draw(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{await this.frame()}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}async frame(){const{canvas:e,gl:t,renderer:r,pacing:n}=this,{path:s}=this.header;if(this.playing!==null&&s){const v=(performance.now()-this.playing)/1e3;this.look(Oe(s,v)),!s.loop&&v>=s.seconds&&(this.playing=null)}if(this.row===null)return;const o=Math.min(devicePixelRatio,ze),[a,c]=[e.clientWidth,e.clientHeight].map(v=>Math.max(1,Math.round(v*o)));(e.width!==a||e.height!==c)&&Object.assign(e,{width:a,height:c});const l=n.scale(a,c),f=performance.now()-this.moved>Fe||l===1,u=f?[a,c]:[a,c].map(v=>Math.max(8,Math.round(v*l)));this.aim(u[0],u[1]);const h=f?this.row:0,d=f?Math.min(n.rows(a,c),c-h):u[1],x=this.moved;if(!r.render({rows:{first:h,count:d}}))return;const m=h+d>=u[1];m&&r.show(a,c),n.took(u[0]*d,await De(t)),this.moved===x&&f&&(this.row=m?null:h+d)}aim(e,t){const r=.5*Math.min(e,t)/this.tangent;this.renderer.setSize(e,t),this.renderer.setCamera({c2w:this.orbit.c2w,width:e,height:t,fx:r,fy:r,cx:e/2,cy:t/2})}}window.cagefieldViewer={FieldRenderer:H,readEdits:W};function S(i){const e=document.querySelector(i);if(!e)throw new Error(`the page has no ${i}`);return e}function J(i){const e=document.getElementById(i);if(!e)return null;const t=atob(e.textContent.trim());e.remove();const r=new Uint8Array(t.length);for(let n=0;n<t.length;n++)r[n]=t.charCodeAt(n);return r.buffer}async function Ne(i){const e=S(".message"),t=r=>void(e.textContent=r);try{const r=new Ce(S("canvas"),i,t);window.cagefieldViewer.viewer=r;const[n,s,o]=[S(".compare"),S(".play"),S(".home")],a=J("field"),c=J("edits");if(n.hidden=c===null,s.hidden=i.path===null,n.onclick=()=>{r.edited=!r.edited,n.textContent=r.edited?"Show before":"Show after"},s.onclick=()=>r.play(!r.plays),o.onclick=()=>r.home(),setInterval(()=>void(s.textContent=r.plays?"Stop":"Play"),200),window.addEventListener("keydown",({key:l})=>{l==="b"&&n.click(),l===" "&&s.click(),l==="h"&&o.click()}),a===null)throw new Error("the file holds no field; export the scene again");await r.run(a,c)}catch(r){t(r instanceof Error?r.message:String(r))}}const Z=document.getElementById("scene");Z&&Ne(JSON.parse(Z.textContent))})();
